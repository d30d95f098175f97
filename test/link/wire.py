"""LCM's datagrams, our envelope and its seal, in Python: an independent reading of what the C++ does."""
import hashlib
import hmac
import pathlib
import socket
import struct
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "replay"))
import lcmlog  # noqa: E402

GROUP, PORT = "239.255.76.67", 7667
HEAVY = ("LIDAR_SCAN", "CAMERA_IMAGE", "SCAN_REGISTERED", "MAP")
TAG = 16


def seal(name, data, key):
    return data + hmac.new(key, name.encode() + b"\0" + data, hashlib.sha256).digest()[:TAG] if key else data


def of_vehicle(data, vehicle, sender=None):
    """The same message with another vehicle, and sender, in its envelope."""
    length, = struct.unpack_from(">i", data, 20)
    who = data[24:24 + length] if sender is None else sender.encode() + b"\0"
    rest = 24 + length
    rest += 4 + struct.unpack_from(">i", data, rest)[0]
    name = vehicle.encode() + b"\0"
    return data[:20] + struct.pack(">i", len(who)) + who + struct.pack(">i", len(name)) + name + data[rest:]


def datagrams(channel, data, seq):
    name = channel.encode() + b"\0"
    if len(name) + len(data) < 1400:
        return [struct.pack(">4sI", b"LC02", seq) + name + data]
    chunks = [data[i:i + 60000] for i in range(0, len(data), 60000)]
    return [struct.pack(">4sIIIHH", b"LC03", seq, len(data), 60000 * i, i, len(chunks)) +
            (name if i == 0 else b"") + chunk for i, chunk in enumerate(chunks)]


def channel_and_data(packet):
    """Of a short message, or the channel alone of a long one's first part; ('', b'') of others."""
    if packet[:4] == b"LC02":
        name, _, data = packet[8:].partition(b"\0")
        return name.decode("ascii", "replace"), data
    if packet[:4] == b"LC03" and packet[16:18] == b"\0\0":
        return packet[20:].split(b"\0", 1)[0].decode("ascii", "replace"), b""
    return "", b""


def listener():
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
    sock.bind(("", PORT))
    sock.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP) + socket.inet_aton("0.0.0.0"))
    return sock


def channels_of_status(data):
    """{channel: (received, foreign)} of a STATUS message."""
    at = lcmlog.after_head(data)

    def text():
        nonlocal at
        length, = struct.unpack_from(">i", data, at)
        at += 4 + length
        return data[at - length:at - 1].decode()

    text()
    at += 1  # state
    for _ in range(3):
        text()
    at += 24  # uptime, cpu, memory
    count, = struct.unpack_from(">i", data, at)
    at += 4
    found = {}
    for _ in range(count):
        name = text()
        received, _, foreign, _ = struct.unpack_from(">4q", data, at)
        at += 40
        found[name] = (received, foreign)
    return found


def play(events, vehicle, key, seconds):
    """Publishes a recording's messages as a vehicle's, at the pace of their stamps and never faster; every fifth of
    the heavy ones, for Python. Count by channel."""
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    counts, heard, seq, first, begun = {}, {}, 0, None, time.monotonic()
    for utime, channel, data in events:
        if channel.endswith("_STATUS"):
            continue  # the processes that run here have their own
        first = utime if first is None else first
        if 1e-6 * (utime - first) > seconds:
            break
        heard[channel] = heard.get(channel, -1) + 1
        if channel in HEAVY and heard[channel] % 5:
            continue
        wait = begun + 1e-6 * (utime - first) - time.monotonic()
        time.sleep(max(0.0, wait))
        begun += max(0.0, -wait)  # what is late is not caught up
        data = of_vehicle(data, vehicle)
        if channel not in HEAVY:
            data = seal(vehicle + channel, data, key)
        for packet in datagrams(vehicle + channel, data, seq):
            out.sendto(packet, (GROUP, PORT))
        seq += 1
        counts[channel] = counts.get(channel, 0) + 1
    return counts
