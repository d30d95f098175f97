#!/usr/bin/env python3
"""Two vehicles and a ground station, each a host of its own, joined by a path that loses 2 %, takes 40 ms and carries
1 MB/s for each vehicle: light messages cross, heavy ones stay, nothing is lost on board whatever becomes of the
ground, and what a stranger sends is refused. On one bus neither vehicle hears the other.

two_hosts.py BIN FLIGHT.lcm, in a network namespace of its own"""

import contextlib
import heapq
import json
import os
import pathlib
import random
import select
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import wire

HERE = pathlib.Path(__file__).resolve()
LOSS_ONE_IN, DELAY, RATE, QUEUE = 50, 0.040, 1e6, 0.5  # packets, s, bytes/s, s
SECONDS = 16.0  # of flight
VEHICLES = {"falcon_": 1, "eagle_": 2}
LINK_PORT = 7700


class Host:
    """A network namespace whose h0 leads to ours."""

    def __init__(self, number):
        self.here, self.there = f"10.{number}.0.1", f"10.{number}.0.2"
        self.name = f"r{number}"
        self.children = [subprocess.Popen(["unshare", "--net", "sleep", "infinity"], stdout=subprocess.DEVNULL)]
        self.pid = self.children[0].pid
        for _ in range(100):  # until it is in its namespace
            if os.readlink(f"/proc/{self.pid}/ns/net") != os.readlink("/proc/self/ns/net"):
                break
            time.sleep(0.02)

    def connect(self):
        run(f"ip link add {self.name} type veth peer name h0 netns {self.pid}")
        run(f"ip addr add {self.here}/24 dev {self.name} && ip link set {self.name} up")
        self.run(f"ip link set lo up && ip link set lo multicast on && ip addr add {self.there}/24 dev h0 && "
                 f"ip link set h0 up && ip route add {wire.GROUP}/32 dev lo")

    def run(self, command):
        run(f"nsenter -t {self.pid} -n sh -c '{command}'")

    def start(self, *command, **more):
        child = subprocess.Popen(["nsenter", "-t", str(self.pid), "-n", *map(str, command)], **more)
        self.children.append(child)
        return child

    def python(self, *words):
        """This file's other half, in the host: see main()."""
        return self.start(sys.executable, "-B", HERE, *words, stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True)

    def stop(self):
        for child in reversed(self.children):
            child.kill()
            child.wait()
            for pipe in (child.stdin, child.stdout):
                with contextlib.suppress(AttributeError, BrokenPipeError):
                    pipe.close()
        subprocess.run(["ip", "link", "del", self.name], stderr=subprocess.DEVNULL, check=False)


def run(command):
    subprocess.run(command, shell=True, check=True)


class Path:
    """One way of a radio: exactly one of 50 packets is lost, the rest is late, what its queue does not hold is dropped."""

    def __init__(self, seed):
        self.draw, self.left, self.free, self.waiting = random.Random(seed), [], 0.0, []
        self.up, self.passed, self.dropped, self.bytes = True, 0, 0, 0
        self.channels, self.sample = {}, []

    def put(self, packet, now):
        if not self.up:
            return
        if not self.left:
            self.left = [True] * (LOSS_ONE_IN - 1) + [False]
            self.draw.shuffle(self.left)
        self.free = max(self.free, now) + len(packet) / RATE
        if not self.left.pop() or self.free - now > QUEUE:
            self.dropped += 1
            return
        heapq.heappush(self.waiting, (self.free + DELAY, self.passed, packet))
        self.passed, self.bytes = self.passed + 1, self.bytes + len(packet)
        for name in channels_in(packet):
            self.channels[name] = self.channels.get(name, 0) + 1
            if name == "COMMAND":
                self.sample.append(packet)

    def due(self, now):
        while self.waiting and self.waiting[0][0] <= now:
            yield heapq.heappop(self.waiting)[2]


def channels_in(packet, tag=wire.TAG):
    """Channels of a packet of the link, by its README."""
    at, end = 24, len(packet) - tag
    while at + 11 <= end:
        _, _, _, name, size = struct.unpack_from(">IHHBH", packet, at)
        yield packet[at + 11:at + 11 + name].decode("ascii", "replace")
        at += 11 + name + size


class Relay(threading.Thread):
    """Between each vehicle and the ground: a port of ours for each, and a path for each way."""

    def __init__(self, hosts, ground):
        super().__init__(daemon=True)
        self.ways, self.done = {}, False
        for vehicle, host in hosts.items():
            port = LINK_PORT + VEHICLES[vehicle]
            air, earth = (bound((host.here, LINK_PORT)), bound((ground.here, port)))
            self.ways[air] = (Path(port), earth, (ground.there, port))
            self.ways[earth] = (Path(port + 50), air, (host.there, LINK_PORT))
            setattr(self, vehicle, (self.ways[air][0], self.ways[earth][0]))

    def run(self):
        while not self.done:
            ready, _, _ = select.select(list(self.ways), [], [], 0.002)
            now = time.monotonic()
            for sock in ready:
                self.ways[sock][0].put(sock.recv(2048), now)
            for path, out, to in self.ways.values():
                for packet in path.due(now):
                    out.sendto(packet, to)

    def stop(self):
        self.done = True
        self.join()
        for sock in self.ways:
            sock.close()


def bound(address):
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind(address)
    return sock


def told(child):
    """Ends a listener or waits for a player; what it counted."""
    with contextlib.suppress(BrokenPipeError):  # a player is done by itself
        child.stdin.write("\n")
        child.stdin.flush()
    return json.loads(child.stdout.readline())


def share(seen, sent, vehicle):
    light = [c for c in sent if c not in wire.HEAVY]
    return sum(seen.get(vehicle + c, 0) for c in light), sum(sent[c] for c in light)


class TwoHosts(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.keys = {v: random.Random(n).randbytes(32) for v, n in VEHICLES.items()}
        self.hosts = {v: self.host(n) for v, n in VEHICLES.items()}
        self.ground = self.host(3)
        self.relay = Relay(self.hosts, self.ground)
        self.relay.start()
        self.addCleanup(self.relay.stop)

    def host(self, number):
        host = Host(number)
        self.addCleanup(host.stop)
        host.connect()
        return host

    def file(self, name, text):
        path = self.folder / name
        path.write_text(text, encoding="utf-8")
        return path

    def key_file(self, vehicle):
        path = self.folder / f"{vehicle}key"
        return path if path.exists() else self.file(path.name, self.keys[vehicle].hex() + "\n")

    def sealed(self, vehicle):
        """Falcon's bus is sealed as well; eagle's link alone."""
        return ["--key-file", self.key_file(vehicle)] if vehicle == "falcon_" else []

    def service(self, host, vehicle, name, config="{}"):
        file = self.file(f"{vehicle}{name}{host.pid}.yaml", config)
        return host.start(BIN / f"chase-{name}", "--channel-prefix", vehicle, "--config", file, *self.sealed(vehicle))

    def vehicle_link(self, vehicle):
        host = self.hosts[vehicle]
        return self.service(host, vehicle, "link", f"{{side: vehicle, peer: '{host.here}:{LINK_PORT}', "
                                                   f"key_file: {self.key_file(vehicle)}}}")

    def ground_link(self, vehicle):
        port = LINK_PORT + VEHICLES[vehicle]
        return self.service(self.ground, vehicle, "link", f"{{side: ground, port: {port}, peer: '{self.ground.here}:{port}', "
                                                          f"key_file: {self.key_file(vehicle)}}}")

    def listen(self, host):
        child = host.python("listen")
        self.assertEqual(child.stdout.readline(), "ready\n")
        return child

    def play(self, vehicle, seconds=SECONDS, host=None):
        key = self.keys[vehicle].hex() if vehicle == "falcon_" else ""
        return (host or self.hosts[vehicle]).python("play", FLIGHT, vehicle, key, seconds)

    def test_messages_and_commands(self):
        self.service(self.hosts["falcon_"], "falcon_", "mission")
        for vehicle in VEHICLES:
            self.vehicle_link(vehicle)
            self.ground_link(vehicle)
        time.sleep(1.5)
        aboard = {v: self.listen(self.hosts[v]) for v in VEHICLES}
        below = self.listen(self.ground)
        players = {v: self.play(v) for v in VEHICLES}
        answer = self.command("takeoff", "falcon_")
        self.assertEqual(answer.returncode, 2, answer.stderr)  # mission's own word, and not silence
        self.assertIn("takeoff in IDLE", answer.stderr)
        self.assertEqual(self.command("takeoff", "eagle_").returncode, 3)  # it has no mission, and falcon's does not hear
        sent = {v: told(players[v]) for v in VEHICLES}
        time.sleep(1.0)  # what is under way
        seen = told(below)
        for vehicle in VEHICLES:
            came, of = share(seen, sent[vehicle], vehicle)
            here = told(aboard[vehicle])
            heard, _ = share(here, sent[vehicle], vehicle)
            up, down = getattr(self.relay, vehicle)
            print(f"{vehicle}: {of} light messages: on board {heard}, on the ground {came} ({100 * came / of:.2f} %); link "
                  f"{up.bytes / SECONDS / 1e3:.0f} kB/s, {up.dropped} of {up.passed + up.dropped} packets lost")
            self.assertGreater(of, 3000)
            self.assertEqual(heard, of)
            self.assertGreaterEqual(came, 0.97 * of)
            for channel in wire.HEAVY:
                self.assertGreater(sent[vehicle].get(channel, 1), 0)
                self.assertNotIn(channel, up.channels)
                self.assertNotIn(vehicle + channel, seen)
            self.assertEqual(set(down.channels) - {"COMMAND"}, set())
            others = [name for name in here if not name.startswith(vehicle) and name != "status"]
            self.assertEqual(others, [])
        self.assertIn("LIDAR_SCAN", sent["falcon_"])
        self.assertIn("COMMAND", self.relay.falcon_[1].channels)

    def command(self, name, vehicle, host=None):
        child = (host or self.ground).start(BIN / "chase-command", name, "--vehicle", vehicle, *self.sealed(vehicle),
                                  stderr=subprocess.PIPE, text=True)
        _, words = child.communicate(timeout=20)
        return subprocess.CompletedProcess([], child.returncode, "", words)

    def test_two_vehicles_on_one_bus(self):
        """Each process hears its own vehicle's commands, plans and setpoints, all of them and no others."""
        host = self.hosts["falcon_"]
        controls = []
        for vehicle, number in VEHICLES.items():
            controls.append(self.service(host, vehicle, "control"))
            self.service(host, vehicle, "fcu", f"{{port: {14540 + number}}}")
            self.service(host, vehicle, "mission")
        time.sleep(1.5)
        bus = self.listen(host)
        players = {vehicle: self.play(vehicle, seconds, host) for vehicle, seconds in zip(VEHICLES, (6.0, 3.0))}
        self.assertEqual(self.command("takeoff", "falcon_", host).returncode, 2)  # mission's own word
        sent = {vehicle: told(player) for vehicle, player in players.items()}
        time.sleep(2.0)  # until each process has told its counts
        for control in controls:  # it sends setpoints as well
            control.kill()
        time.sleep(2.0)
        here = told(bus)
        for vehicle in VEHICLES:
            for channel, process in (("PLAN", "CONTROL"), ("ATTITUDE_SETPOINT", "FCU"), ("COMMAND", "MISSION")):
                received, foreign = here["status"][f"{vehicle}{process}_STATUS"][channel]
                own = here.get(vehicle + channel, 0)
                print(f"{vehicle}{process}: {channel}: {received} heard of {own} of its own, {foreign} refused")
                self.assertEqual((received, foreign), (own, 0))
                self.assertGreaterEqual(own, sent[vehicle].get(channel, 0))
        self.assertGreater(sent["falcon_"]["PLAN"], sent["eagle_"]["PLAN"])
        self.assertGreater(here["falcon_COMMAND"], 0)
        self.assertNotIn("eagle_COMMAND", here)

    def test_losing_the_ground_harms_nothing(self):
        vehicle = "falcon_"
        self.vehicle_link(vehicle)
        ground = self.ground_link(vehicle)
        time.sleep(1.0)
        aboard, below = self.listen(self.hosts[vehicle]), self.listen(self.ground)
        player = self.play(vehicle)
        time.sleep(4.0)
        ground.kill()
        for path in self.relay.falcon_:
            path.up = False
        time.sleep(6.0)
        for path in self.relay.falcon_:
            path.up = True
        self.ground_link(vehicle)
        sent = told(player)
        time.sleep(1.0)
        heard, of = share(told(aboard), sent, vehicle)
        came, _ = share(told(below), sent, vehicle)
        print(f"ground gone for 6 of {SECONDS:.0f} s: on board {heard} of {of}, on the ground {came}")
        self.assertEqual(heard, of)
        self.assertGreater(came, 0.5 * of)  # before and after
        self.assertLess(came, 0.75 * of)

    def test_strangers_are_refused(self):
        for vehicle in VEHICLES:
            self.vehicle_link(vehicle)
            self.service(self.hosts[vehicle], vehicle, "control")
            self.service(self.hosts[vehicle], vehicle, "fcu")
        first = self.ground_link("falcon_")
        time.sleep(1.0)
        self.command("hold", "falcon_")  # recorded by the relay
        first.kill()
        self.ground_link("falcon_")
        time.sleep(1.0)
        aboard = {v: self.listen(self.hosts[v]) for v in VEHICLES}
        genuine = {v: told(self.play(v, 4.0)) for v in VEHICLES}
        samples = messages("PLAN", "ATTITUDE_SETPOINT")
        forged = self.forge()
        self.forge_link(samples)
        time.sleep(2.5)
        for vehicle in VEHICLES:
            here = told(aboard[vehicle])
            for channel, process in (("PLAN", "CONTROL"), ("ATTITUDE_SETPOINT", "FCU")):
                received, foreign = here["status"][f"{vehicle}{process}_STATUS"][channel]
                print(f"{vehicle}{process}: {channel}: {received} heard of {genuine[vehicle][channel]} genuine ones, "
                      f"{foreign} of {forged[vehicle]} forged refused")
                self.assertEqual(foreign, forged[vehicle])
                if channel == "PLAN":  # setpoints come from control as well
                    self.assertEqual(received, genuine[vehicle][channel])
            self.assertEqual(here[vehicle + "PLAN"], genuine[vehicle]["PLAN"] + forged[vehicle])  # none over the link
            self.assertEqual(here.get(vehicle + "COMMAND", 0), 0)  # of those over the link

    def forge(self):
        """On the vehicle's own bus. How many of each channel."""
        children = {v: self.hosts[v].python("forge", FLIGHT, v, self.keys[v].hex(), self.keys["eagle_"].hex())
                    for v in VEHICLES}
        return {v: told(child) for v, child in children.items()}

    def forge_link(self, samples):
        """To the link, from the peer's own address: without a seal, with another's, and recorded earlier."""
        def packet(session, channel, data):
            return (b"CHL2" + struct.pack(">qqI", session, 0, 0) +
                    struct.pack(">IHHBH", 0, 0, 1, len(channel), len(data)) + channel.encode() + data)

        for vehicle, host in self.hosts.items():
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
                out.bind((host.here, 0))
                for channel, data in (*samples.items(), ("COMMAND", b"x" * 80)):
                    bare = packet(2**62, channel, data[:1000])
                    for bytes_ in (bare, wire.seal("ground", bare, random.Random(9).randbytes(32)),
                                   wire.seal("vehicle", bare, self.keys[vehicle])):
                        out.sendto(bytes_, (host.there, LINK_PORT))
                for old in getattr(self.relay, vehicle)[1].sample:
                    out.sendto(old, (host.there, LINK_PORT))
        self.assertTrue(self.relay.falcon_[1].sample)


def messages(*channels):
    """The first of each channel in the recording."""
    found = {}
    for _, channel, data in wire.lcmlog.read(FLIGHT):
        if channel in channels:
            found.setdefault(channel, data)
        if len(found) == len(channels):
            return found
    raise AssertionError(f"{FLIGHT} lacks one of {channels}")


def forge(vehicle, key, other):
    """Plans and setpoints that are nearly the vehicle's. How many of each."""
    count = 0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        for _ in range(20):
            for channel, data in messages("PLAN", "ATTITUDE_SETPOINT").items():
                perfect = wire.of_vehicle(data, vehicle)
                if vehicle == "falcon_":  # only the key tells it from its own, and the number from a recording
                    tries = [perfect, wire.seal(vehicle + channel, perfect, other),
                             wire.seal(vehicle + "POSE", perfect, key), wire.seal(vehicle + channel, perfect, key)]
                else:  # without one, the envelope does
                    tries = [wire.of_vehicle(data, "falcon_"), wire.of_vehicle(data, vehicle, "stranger"), data]
                for number, message in enumerate(tries):
                    for packet in wire.datagrams(vehicle + channel, message, 4 * count + number):
                        out.sendto(packet, (wire.GROUP, wire.PORT))
            count += len(tries)
            time.sleep(0.02)
    return count


def listen():
    """Counts by channel until a line comes; the channels of the last statuses."""
    sock = wire.listener()
    print("ready", flush=True)
    counts, status = {}, {}
    while not select.select([sys.stdin], [], [], 0)[0] or select.select([sock], [], [], 0)[0]:
        if not select.select([sock], [], [], 0.05)[0]:
            continue
        name, data = wire.channel_and_data(sock.recv(65536))
        if not name:
            continue
        counts[name] = counts.get(name, 0) + 1
        if name.endswith(("CONTROL_STATUS", "FCU_STATUS", "MISSION_STATUS")) and data:
            status[name] = wire.channels_of_status(data)
    print(json.dumps({**counts, "status": status}), flush=True)


def main():
    global FLIGHT  # pylint: disable=global-statement
    if sys.argv[1] == "listen":
        listen()
    elif sys.argv[1] == "forge":
        FLIGHT, vehicle, *keys = sys.argv[2:]
        print(json.dumps(forge(vehicle, *map(bytes.fromhex, keys))), flush=True)
    elif sys.argv[1] == "play":
        _, _, file, vehicle, key, seconds = sys.argv
        print(json.dumps(wire.play(wire.lcmlog.read(file), vehicle, bytes.fromhex(key), float(seconds))), flush=True)
    else:
        unittest.main(argv=sys.argv[:1])


if __name__ == "__main__":
    if len(sys.argv) == 3:
        BIN, FLIGHT = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    main()
