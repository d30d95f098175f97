#!/usr/bin/env python3
"""Sends damaged messages to every live process: nothing may crash, on every channel that it says it hears each
must be counted in the status, and the next good message must be handled. The channels must be those of the table
in test/house/channels.py, which is checked against the code.

Usage: hostile_bus.py BIN_DIR FLIGHT.lcm MISSION.yaml   (run it in a network namespace of its own)
"""
import ctypes
import pathlib
import socket
import struct
import subprocess
import sys
import tempfile
import time

for folder in ("replay", "house"):
    sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / folder))
sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "deploy/launcher"))
sys.dont_write_bytecode = True
import channels  # noqa: E402
import lcmlog  # noqa: E402
import script  # noqa: E402

GROUP, PORT = "239.255.76.67", 7667
NAN = struct.pack(">d", float("nan"))
# Images and clouds come faster than they are read here, and a status among them would be lost: the socket takes
# short messages alone. Classic BPF: the word behind the UDP header, if it is the magic number take all, else nothing.
SO_ATTACH_FILTER = 26
PROGRAM = ctypes.create_string_buffer(struct.pack("HBBI" * 4, 0x20, 0, 0, 8, 0x15, 0, 1, 0x4C433032,
                                                  6, 0, 0, 0xFFFF, 6, 0, 0, 0))
SHORT = struct.pack("HP", 4, ctypes.addressof(PROGRAM))
# These carry what comes and decode nothing.
CARRIES = {"recorder": ["--folder", "{folder}"], "link": []}
# Heard out of logs alone.
OF_LOGS = {"FAULT", "TRUTH"}
# The drivers hear their devices.
TO_HEAR = [service for service, heard in channels.LISTENS.items() if heard]
FENCE = "  - {name: mission, config: 'geofence: {polygon: [[-99, -99], [99, -99], [99, 99], [-99, 99]]}'}\n"
# Learns the target's colour anew, and loses the mission process, so that control tells where home is.
LED = {"  - {command: chase, at_s: -2}\n": "{}  - {{command: select, at_px: [188, 115], at_s: -1}}\n",
       "\nservices:\n": "\nfaults: [{{name: kill-mission, at: 1}}]\n{}"}
# Where the first double of a message stands behind what all begin with.
FIRST_DOUBLE = {"IMU": 0, "POSE": 4, "TARGET": 5, "ATTITUDE_SETPOINT": 0, "SCAN_REGISTERED": 4, "SELECTION": 0,
                "SELECTION_KEPT": 0, "TRACKING": 9}
# Where an array's length stands.
LENGTH = {"LIDAR_SCAN": 0, "OBSTACLES": 4, "SCAN_REGISTERED": 61, "CAMERA_IMAGE": 32, "COMMAND": 9, "GEOFENCE": 4,
          "HEALTH": 0}


class Bus:
    """LCM's UDP multicast protocol: short messages and fragments."""

    def __init__(self):
        self.out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self.out.bind(("", 0))
        self.into = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.into.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.into.setsockopt(socket.SOL_SOCKET, SO_ATTACH_FILTER, SHORT)
        self.into.bind(("", PORT))
        membership = socket.inet_aton(GROUP) + socket.inet_aton("0.0.0.0")
        self.into.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        self.seq = 0

    def send(self, channel, data):
        self.seq += 1
        name = channel.encode() + b"\0"
        if len(data) < 1400:
            packets = [struct.pack(">4sI", b"LC02", self.seq) + name + data]
        else:
            chunks = [data[i:i + 60000] for i in range(0, len(data), 60000)]
            packets = [struct.pack(">4sIIIHH", b"LC03", self.seq, len(data), 60000 * i, i, len(chunks))
                       + (name if i == 0 else b"") + chunk for i, chunk in enumerate(chunks)]
        for packet in packets:
            self.out.sendto(packet, (GROUP, PORT))
            time.sleep(0.001)

    def status(self, name, seconds, enough=lambda status: True):
        """The first status within the time that is enough, or the last: {channel: (received, malformed)}."""
        newest, end = None, time.monotonic() + seconds
        while not (newest and enough(newest)) and (left := end - time.monotonic()) > 0:
            self.into.settimeout(left)
            try:
                packet, (_, port) = self.into.recvfrom(65536)
            except socket.timeout:
                break
            channel, _, data = packet[8:].partition(b"\0")
            ours = port == self.out.getsockname()[1]
            if not ours and channel.decode(errors="replace") == f"{name.upper()}_STATUS":
                newest = parse_status(data)
        return newest


def parse_status(data):
    at = lcmlog.after_head(data)

    def take(form):
        nonlocal at
        value = struct.unpack_from(">" + form, data, at)[0]
        at += struct.calcsize(form if form != "q" and form != "d" else ">" + form)
        return value

    def text():
        nonlocal at
        length = take("i")
        value = data[at:at + length - 1].decode()
        at += length
        return value

    text(), take("b"), text(), text(), text(), take("d"), take("d"), take("d")
    counts = {}
    for _ in range(take("i")):
        name, received, _, _, malformed, _ = text(), *(take("q") for _ in range(4)), take("d")
        counts[name] = (received, malformed)
    return counts


def attacks(channel, good):
    yield b""
    yield b"\xff" * 40
    for n in {7, 12, 19, len(good) // 2, len(good) - 1}:
        yield good[:n]
    yield bytes([good[0] ^ 0x55]) + good[1:]
    if channel in FIRST_DOUBLE:
        at = lcmlog.after_head(good) + FIRST_DOUBLE[channel]
        yield good[:at] + NAN + good[at + 8:]
    if channel in LENGTH:
        at = lcmlog.after_head(good) + LENGTH[channel]
        for length in (b"\xff\xff\xff\xff", b"\x80\x00\x00\x00", b"\x7f\xff\xff\xff"):
            yield good[:at] + length + good[at + 4:]


def attack(bus, channel, good):
    """Sends what is bad, then what is good; how much was bad."""
    bad = list(attacks(channel, good))
    for data in bad:
        bus.send(channel, data)
    bus.send(channel, good)
    return len(bad)


def check_group(bus, process, service, samples):
    sent = {}
    for channel, good in samples.items():
        sent[channel] = attack(bus, channel, good)
        if process.poll() is not None:
            sys.exit(f"{service}: died of {channel} or of what came before")
    status = bus.status(service, 10, lambda s: all(s[channel][0] > 0 for channel in sent))
    if (code := process.poll()) is not None:
        sys.exit(f"{service}: died ({code}) of one of {', '.join(sent)}")
    if status is None:
        sys.exit(f"{service}: no status after {', '.join(sent)}")
    for channel, bad in sent.items():
        received, malformed = status[channel]
        if malformed != bad:
            sys.exit(f"{service}: {channel}: {malformed} of {bad} counted as malformed")
        if received != 1 and channel != f"{service.upper()}_STATUS":  # which it may hear itself
            sys.exit(f"{service}: {channel}: the good message was not handled")
        print(f"{service}: {channel}: {malformed} refused, then 1 handled", flush=True)


def check(bus, bin_dir, service, samples):
    process = subprocess.Popen([f"{bin_dir}/chase-{service}"])
    try:
        if (status := bus.status(service, 6.0)) is None:
            sys.exit(f"{service}: no status")
        if differing := set(status) ^ (channels.LISTENS[service] - OF_LOGS):
            sys.exit(f"{service}: {', '.join(sorted(differing))}: its status and test/house/channels.py do not agree")
        light = [channel for channel in sorted(status) if len(samples[channel]) < 60000]
        for group in [light] + [[channel] for channel in sorted(status.keys() - set(light))]:
            check_group(bus, process, service, {channel: samples[channel] for channel in group})
    finally:
        process.terminate()
        process.wait(timeout=10)


def check_carrier(bus, bin_dir, service, arguments, samples):
    process = subprocess.Popen([f"{bin_dir}/chase-{service}", *arguments])
    try:
        if bus.status(service, 6.0) is None:
            sys.exit(f"{service}: no status")
        for channel, good in samples.items():
            for data in attacks(channel, good):
                bus.send(channel, data)
        if process.poll() is not None or bus.status(service, 3.0) is None:
            sys.exit(f"{service}: died")
        print(f"{service}: lives on")
    finally:
        process.terminate()
        process.wait(timeout=10)


def led_flight(bin_dir, mission, folder):
    """The log of a few seconds with a mission process, an operator and a geofence."""
    scenario, log = folder / "led.yaml", folder / "led.lcm"
    text = pathlib.Path(mission).read_text(encoding="utf-8") + FENCE
    for place, change in LED.items():
        text = text.replace(place, change.format(place))
    scenario.write_text(text, encoding="utf-8")
    subprocess.run([f"{bin_dir}/chase-flight", scenario, "--quiet", "--until", "4", "--log", log],
                   check=True, stdout=subprocess.DEVNULL)
    return log


def main(bin_dir, flight, mission):
    samples = {}
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for log in (flight, led_flight(bin_dir, mission, folder)):
            for _, channel, data in lcmlog.read(log):
                samples.setdefault(channel, data)
        status = samples["CONTROL_STATUS"]
        for heard in channels.LISTENS.values():  # nobody flies along who would send some of them
            samples.update({channel: status for channel in heard - samples.keys() if channel.endswith("_STATUS")})
        if lacking := set().union(*channels.LISTENS.values()) - OF_LOGS - samples.keys():
            sys.exit(f"{', '.join(sorted(lacking))}: nothing in the flights to damage")
        bus = Bus()
        for service in TO_HEAR:
            check(bus, bin_dir, service, samples)
        light = {channel: data for channel, data in samples.items() if len(data) < 60000}
        for service, arguments in CARRIES.items():
            check_carrier(bus, bin_dir, service, [a.format(folder=folder) for a in arguments], light)


main(*script.arguments(__doc__, 3, 3))
