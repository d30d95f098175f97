"""The LCM URL, and what a multicast socket can tell about the network under it."""

import errno
import ipaddress
import os
import re
import socket
import struct
import time

import places

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152"
RECEIVE_BUFFER = 2097152  # bytes; a cloud of 400 kB needs several


def configured(file):
    """The URL that an installed vehicle's units are told, or None."""
    try:
        lines = file.read_text(errors="replace").splitlines()
    except OSError:
        return None
    told = [line.split("=", 1)[1].strip(" \t\"'") for line in lines if line.startswith("LCM_DEFAULT_URL=")]
    return told[-1] if told else None


def url():
    """Where everything speaks: the environment's, an installed vehicle's, the default; with room for sweeps and images
    where the user names none."""
    units = configured(places.ENVIRONMENT) if places.INSTALLED else None
    told = os.environ.get("LCM_DEFAULT_URL") or units or DEFAULT_URL
    if "recv_buf_size=" in told:
        return told
    return f"{told}{'&' if '?' in told else '?'}recv_buf_size={RECEIVE_BUFFER}"


def endpoint(text):
    """(group, port) of a udpm URL, or None where it is something else."""
    match = re.fullmatch(r"udpm://([0-9.]+):([0-9]{1,5})(\?.*)?", text)
    if not match or not 0 < int(match.group(2)) <= 65535 or not address(match.group(1)):
        return None
    return match.group(1), int(match.group(2))


def address(text):
    try:
        return ipaddress.IPv4Address(text)
    except ValueError:
        return None


def stays_on_host(text):
    return "ttl=0" in re.split(r"[?&]", text)[1:]


def listener(group, port):
    """A socket that hears the group. OSError where the port is taken or the route is missing."""
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    request = struct.pack("=4s4s", socket.inet_aton(group), socket.inet_aton("0.0.0.0"))
    try:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        sock.bind(("", port))
        sock.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, request)
    except OSError:
        sock.close()
        raise
    return sock


def send(packet, group, port):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        sock.sendto(packet, (group, port))


def route_cure(group):
    return f"cure: ip link set lo up && ip route add {group}/32 dev lo"


def loopback_problem(group, port):
    """Sends ourselves a packet that LCM passes over; a sentence where it does not come back, else ''."""
    if not address(group).is_multicast:
        return (f"{group} is no multicast address; cure: use one of 224.0.0.0 to 239.255.255.255, "
                "such as 239.255.76.67")
    packet = b"chase loopback %d" % os.getpid()
    try:
        with listener(group, port) as receiver:
            send(packet, group, port)
            if packet in packets(receiver, time.monotonic() + 1.0):
                return ""
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            return f"port {port} is taken by a program that does not share it; {port_cure()}"
        return f"no multicast on {group}:{port} ({error.strerror}); {route_cure(group)}"
    return (f"own messages to {group}:{port} do not come back: a firewall drops them or the route "
            f"is missing; {route_cure(group)}")


def port_cure():
    return ("cure: stop that program, or choose another port: "
            "LCM_DEFAULT_URL='udpm://239.255.76.67:7668?ttl=0&recv_buf_size=2097152'")


def packets(sock, deadline):
    while (left := deadline - time.monotonic()) > 0:
        sock.settimeout(left)
        try:
            yield sock.recv(65536)
        except socket.timeout:
            return


def free_port(ports):
    """The first of these TCP ports that nobody listens on, else 0: any."""
    for port in ports:
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as sock:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                sock.bind(("", port))
                return port
            except OSError:
                pass
    return 0


def await_listener(port, seconds):
    """Returns when somebody takes connections on this TCP port, or after so long."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            socket.create_connection(("127.0.0.1", port), 1.0).close()
            return
        except OSError:
            time.sleep(0.05)


def channel_of(packet):
    """Channel of an LCM packet; of a fragment after the first and of anything else ''."""
    if packet[:4] == b"LC02":
        start = 8
    elif packet[:4] == b"LC03" and len(packet) > 20 and packet[16:18] == b"\0\0":
        start = 20
    else:
        return ""
    return packet[start:].split(b"\0", 1)[0].decode("ascii", "replace")


def foreign_channels(group, port, seconds):
    """Channels that someone else is sending on during `seconds`; any message of ours is foreign
    before a flight. LCM binds every address: other groups on the same port are heard as well."""
    with listener(group, port) as sock:
        heard = {channel_of(p) for p in packets(sock, time.monotonic() + seconds)}
    return sorted(c for c in heard if c)


def kernel(name):
    """An integer under /proc/sys, such as net/core/rmem_max; None where it cannot be read."""
    try:
        with open("/proc/sys/" + name, encoding="ascii") as file:
            return int(file.read().split()[0])
    except (OSError, ValueError):
        return None


if __name__ == "__main__":
    print(url())
