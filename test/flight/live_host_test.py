"""A live flight whose host fails it: its wall clock is set forward and back, and its disk is full.

live_host_test.py BIN_DIR CLOCK, in a network namespace of its own; CLOCK is the library of wall_clock.cpp."""

import json
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path += [str(ROOT / "deploy/launcher"), str(ROOT / "test/replay")]
import bus  # noqa: E402
import lcmlog  # noqa: E402

BIN, CLOCK = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve(strict=True)
SECONDS, FULL = 14, 11  # of the mission; from then on the recorder's disk is
STEPS = [(1, 3600.0), (3, -7200.0), (5, 0.9), (7, -0.9), (9, 5.0)]  # (after this mission time, by), s
LATEST = 3e6  # us from a stamp to its message, where two cores are busy with others; steps of hours and 5 s are more
LONGEST = 0.9e6  # us from a sensor's stamp to its next; the least step
AHEAD = 0.1  # s of a step: it counts for all processes at once
FAULTS = f"\nfaults: [{{name: kill-planning, at: 4}}, {{name: disk-full, at: {FULL}}}]\n"


class Host(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        scenario, cls.steps = (pathlib.Path(folder.name) / name for name in ("host.yaml", "steps"))
        gym = (ROOT / "deploy/scenarios/gym.yaml").read_text(encoding="utf-8")
        scenario.write_text(re.sub(r"(?m)^duration_s: .*$", f"duration_s: {SECONDS}", gym) + FAULTS, encoding="utf-8")
        cls.steps.write_bytes(bytes(64 * 16))
        cls.preloaded = {**os.environ, "LD_PRELOAD": str(CLOCK), "CHASE_TEST_CLOCK": str(cls.steps)}
        cls.heard, over = [], threading.Event()
        listener = threading.Thread(target=cls.listen, args=(over,))
        listener.start()
        cls.fly(scenario)
        over.set()
        listener.join()
        cls.flown = pathlib.Path(re.search(r"into (.*)$", cls.said, re.MULTILINE)[1])
        cls.log = list(lcmlog.read(cls.flown / "flight.lcm"))

    @classmethod
    def listen(cls, over):
        with bus.listener(*bus.endpoint(bus.url())) as sock:
            while not over.is_set():
                cls.heard += [packet for packet in bus.packets(sock, time.monotonic() + 0.5) if bus.channel_of(packet) == "RECORDER_STATUS"]

    @classmethod
    def fly(cls, scenario):
        cls.said, left, at = "", list(STEPS), 0
        command = [ROOT / "deploy/fly", scenario, "--hardware"]
        with subprocess.Popen(command, cwd=ROOT, env=cls.preloaded, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as flight, \
                open(cls.steps, "r+b", buffering=0) as steps:
            for line in flight.stdout:
                cls.said += line
                t = re.match(r"t +(-?[\d.]+) /", line)
                if t and left and float(t[1]) > left[0][0]:
                    steps.write(struct.pack("=qq", *(round(1e6 * s) for s in (time.time() + AHEAD, left.pop(0)[1]))))

    def test_the_clock_was_set(self):
        """What is preloaded counts."""
        said = subprocess.run(["date", "+%s"], env=self.preloaded, capture_output=True, text=True, check=True).stdout
        self.assertAlmostEqual(float(said) - time.time(), sum(by for _, by in STEPS), delta=2)

    def test_it_goes_on_to_its_end(self):
        self.assertRegex(self.said, rf"t +{SECONDS}\.0 / {SECONDS} s")
        criteria = json.loads((self.flown / "metrics.json").read_text(encoding="utf-8"))["criteria"]
        self.assertTrue(criteria["safe_ratio"] and criteria["finite_setpoints"], criteria)  # "complete" is a log that is whole
        self.assertEqual(re.findall(r".*restarted$", self.said, re.MULTILINE), ["planning ended (SIGKILL): restarted"])

    def test_no_stamp_knows_of_the_clock(self):
        """Not even of who has come up since."""
        times = [utime for utime, _, _ in self.log]
        self.assertEqual(times, sorted(times))
        self.assertLess(max(b - a for a, b in zip(times, times[1:])), LATEST)
        for utime, channel, data in self.log:
            if channel != "PLAN":  # of the time from which on it is flown
                self.assertLess(abs(utime - struct.unpack_from(">q", data, 8)[0]), LATEST, channel)
        last = {}
        for _, channel, data in self.log:
            if channel in ("CAMERA_IMAGE", "POSE", "IMU"):
                stamp, source = struct.unpack_from(">q", data, 8)[0], (channel, lcmlog.sender(data))
                gap = stamp - last.get(source, stamp - 1)
                self.assertTrue(0 < gap < LONGEST, (source, gap))
                last[source] = stamp
        self.assertEqual({channel for channel, _ in last}, {"CAMERA_IMAGE", "POSE", "IMU"})
        sweeps = [struct.unpack_from(">q", data, 8)[0] for _, channel, data in self.log if channel == "LIDAR_SCAN"]
        self.assertEqual(sweeps, sorted(sweeps))

    def test_the_recorder_tells_of_the_full_disk_and_keeps_what_it_has(self):
        self.assertTrue(any(b"the disk refuses" in packet for packet in self.heard))
        info = subprocess.run([BIN / "chase-log", "info", self.flown / "flight.lcm"], capture_output=True, text=True, check=False).stdout
        self.assertRegex(info, "RECORDER_STATUS")
        self.assertNotRegex(info, "damaged|cut off")
        told = [utime for utime, channel, data in self.log if channel == "FAULT" and b"disk-full" in data]
        self.assertEqual(len(told), 1)
        self.assertLess(self.log[-1][0] - told[0], LATEST)
        self.assertEqual([log.name for log in self.flown.glob("*.lcm")], ["flight.lcm"])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
