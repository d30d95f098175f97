"""Flights in lockstep in which something fails: the same bytes every time, the failure where it was asked
for, and the end at a collision.

faults_test.py BIN_DIR SCENARIO"""

import filecmp
import json
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "replay"))
import lcmlog

BIN, SCENARIO = pathlib.Path(sys.argv[1]), sys.argv[2]
START = 9.0  # s of the log at mission time zero: power-on at 1 s, settle_s 8 s
LIMIT = 200  # s


def flight(*arguments, scenario=SCENARIO):
    command = [BIN / "chase-flight", scenario, "--quiet", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=LIMIT, check=False)


def stamps(log, channel):
    """(mission time of delivery, seq) of every message of a channel."""
    return [(utime * 1e-6 - START, struct.unpack_from(">i", data, 16)[0])
            for utime, name, data in lcmlog.read(log) if name == channel and whole(data)]


def whole(data):
    """Is it a message? What floods the bus is random bytes, and so would its stamp be."""
    return len(data) >= 20 and 0 < struct.unpack_from(">q", data, 8)[0] < 10**12


def faults(log):
    """(name, phase, mission time) of every FAULT."""
    for utime, name, data in lcmlog.read(log):
        if name == "FAULT" and whole(data):
            at = lcmlog.after_head(data)
            length = struct.unpack_from(">i", data, at)[0]
            text = data[at + 4:at + 3 + length].decode()
            yield text, data[at + 4 + length], round(utime * 1e-6 - START, 3)


class Faults(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_flight_with_faults_repeats_and_shows_them(self):
        logs = [self.folder / name for name in ("a.lcm", "b.lcm")]
        metrics = self.folder / "metrics.json"
        for log in logs:
            answer = flight("--fault", "kill-planning@1", "--fault", "lidar-gap@0.75", "--until", 3,
                            "--log", log, "--metrics", metrics)
            self.assertEqual((answer.returncode, answer.stderr), (0, ""))
        self.assertTrue(filecmp.cmp(*logs, shallow=False), "two flights, different bytes")
        self.assertEqual(list(faults(logs[0])),
                         [("lidar-gap", 1, 0.75), ("kill-planning", 1, 1.0),
                          ("kill-planning", 0, 1.5), ("lidar-gap", 0, 1.75)])
        self.check_gap(stamps(logs[0], "LIDAR_SCAN"), 0.75, 1.75, restarts=False)
        self.check_gap(stamps(logs[0], "PLAN"), 1.0, 1.5, restarts=True)
        figures = json.loads(metrics.read_text(encoding="utf-8"))
        self.assertEqual((figures["fault"], figures["fault_time_s"]), ("lidar-gap+kill-planning", 0.75))
        self.assertIn("of the part flown", answer.stdout)

    def test_faults_of_the_bus_repeat_and_show(self):
        logs = [self.folder / name for name in ("a.lcm", "b.lcm")]
        for log in logs:
            answer = flight("--fault", "delay-POSE@0.5", "--fault", "loss-20@1", "--fault", "flood@1.5",
                            "--until", 3, "--log", log)
            self.assertEqual((answer.returncode, answer.stderr), (0, ""))
        self.assertTrue(filecmp.cmp(*logs, shallow=False), "two flights, different bytes")
        self.assertEqual(list(faults(logs[0])),
                         [("delay-POSE", 1, 0.5), ("loss-20", 1, 1.0), ("flood", 1, 1.5),
                          ("delay-POSE", 0, 2.5)])
        poses = [t for t, _ in stamps(logs[0], "POSE") if 0.5 < t < 1.5]
        self.assertGreater(min(t for t in poses if t > 0.51), 0.8)

    def check_gap(self, messages, begin, end, restarts):
        """Nothing between the times but what was under way; seq goes on, or starts anew after."""
        before = [seq for t, seq in messages if t < begin + 0.003]
        after = [seq for t, seq in messages if t >= end]
        self.assertEqual(len(before) + len(after), len(messages))
        self.assertGreater(min(len(before), len(after)), 4)
        first = 0 if restarts else len(before)
        self.assertEqual(before + after, list(range(len(before))) +
                         list(range(first, first + len(after))))

    def test_time_is_drawn_from_seed_and_name(self):
        def drawn(seed, fault="lidar-dead"):
            answer = flight("--fault", fault, "--seed", seed, "--print-config", "simulator")
            return float(re.search(fault + r".*\n\s+at: ([\d.]+)", answer.stdout).group(1))
        times = [drawn(seed) for seed in (1, 1, 2, 3)] + [drawn(1, "gust")]
        self.assertEqual(times[0], times[1])
        self.assertEqual(len(set(times)), 4)
        self.assertTrue(all(12.0 <= t <= 42.0 for t in times), times)  # of 60 s

    def test_sensor_fault_needs_sensors(self):
        answer = flight("--fault", "lidar-gap", "--sensors", "truth")
        self.assertEqual((answer.returncode, answer.stdout), (1, ""))
        self.assertRegex(answer.stderr, "lidar-gap.*truth.*--sensors raw")

    def test_fault_that_strikes_nothing_is_refused(self):
        for fault, cure in (("disk-full", "fly live"), ("disk-ful", "cpu-load, disk-full")):
            answer = flight("--fault", fault)
            self.assertEqual((answer.returncode, answer.stdout), (1, ""))
            self.assertEqual(answer.stderr.count("\n"), 1)
            self.assertRegex(answer.stderr, f"{fault}.*{cure}")
        answer = flight("--fault", "gust@-8.5")
        self.assertEqual((answer.returncode, answer.stdout), (1, ""))
        self.assertRegex(answer.stderr, r"--fault gust@-8.5: faults\[0\]: at is -8.5; it must be from -settle_s, -8, to below .*60")
        answer = flight("--fault", "gust@12", "--until", "12")
        self.assertEqual((answer.returncode, answer.stdout), (1, ""))
        self.assertEqual(answer.stderr, "chase-flight: --fault gust@12: the flight ends at 12 s, before it\n")

    def test_a_scenario_with_a_full_disk_flies_live(self):
        """deploy/fly asks for the configurations of its processes, and fills the recorder's disk itself."""
        scenario = self.folder / "full.yaml"
        scenario.write_text(pathlib.Path(SCENARIO).read_text(encoding="utf-8") + "\nfaults: [{name: disk-full}]\n",
                            encoding="utf-8")
        answer = flight("--print-config", "planning", scenario=scenario)
        self.assertEqual((answer.returncode, answer.stderr), (0, ""))
        self.assertRegex(flight(scenario=scenario).stderr, "disk-full.*fly live")
        answer = subprocess.run([BIN / "chase-scenario", scenario], capture_output=True, text=True, check=True, timeout=LIMIT)
        (fault,) = json.loads(answer.stdout)["faults"]
        self.assertEqual((fault["name"], fault["for_s"]), ("disk-full", None), "to the end")

    def test_mission_flies_where_a_fault_strikes(self):
        """As live, whatever the fault; without one nobody tells a state."""
        log = self.folder / "any.lcm"
        answer = flight("--fault", "lidar-gap@0.2", "--until", "0.5", "--log", log, "--light")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertEqual(self.states(log)[-1], 3, "CHASE")
        answer = flight("--until", "0.5", "--log", log, "--light")
        self.assertEqual((answer.returncode, self.states(log)), (0, []))

    def states(self, log):
        return [data[lcmlog.after_head(data) + 4] for _, name, data in lcmlog.read(log) if name == "FLIGHT_STATE"]

    def test_a_fault_strikes_in_take_off(self):
        """Planning dies in the climb and goes on with it."""
        log = self.folder / "climb.lcm"
        answer = flight("--fault", "kill-planning@-4.5", "--fault", "lidar-gap@-8", "--until", 3, "--log", log, "--light")
        self.assertEqual((answer.returncode, answer.stderr), (0, ""))
        self.assertEqual(list(faults(log)), [("lidar-gap", 1, -8.0), ("lidar-gap", 0, -7.0),
                                             ("kill-planning", 1, -4.5), ("kill-planning", 0, -4.0)])
        self.assertEqual(self.states(log)[-1], 3, "CHASE")

    def test_mission_starts_anew_in_flight(self):
        """Killed and back 0.5 s later; the state it finds is the flight's."""
        log = self.folder / "mission.lcm"
        answer = flight("--fault", "kill-mission@1", "--until", "3", "--log", log, "--light")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        told = [t for t, _ in stamps(log, "FLIGHT_STATE")]
        self.assertGreater(max(b - a for a, b in zip(told, told[1:])), 0.4)
        self.assertLess(told[0], -7.0)
        self.assertGreater(told[-1], 2.8)
        states = self.states(log)
        back = next(i for i, (a, b) in enumerate(zip(told, told[1:]), 1) if b - a > 0.4)
        self.assertEqual({states[back - 1], *states[back + 5:]}, {3}, "CHASE")

    def test_an_emergency_outlives_mission(self):
        """Control is silent by then, but tells what was led last; the pose comes back at 8 s."""
        scenario, log = self.folder / "emergency.yaml", self.folder / "emergency.lcm"
        scenario.write_text(pathlib.Path(SCENARIO).read_text(encoding="utf-8")
                            + "\nfaults: [{name: freeze-odometry, at: 1, for: 7}, {name: kill-mission, at: 5}]\n", encoding="utf-8")
        answer = flight("--until", "9", "--log", log, "--light", scenario=scenario)
        self.assertEqual(answer.returncode, 0, answer.stderr)
        told = list(zip((t for t, _ in stamps(log, "FLIGHT_STATE")), self.states(log)))
        self.assertEqual({state for t, state in told if 3.2 < t < 5 or 5.7 < t < 8}, {9}, "EMERGENCY")

    def test_what_was_selected_outlives_perception(self):
        """The configured colour is nobody's: the target is known by what was selected alone."""
        scenario, log = self.folder / "selected.yaml", self.folder / "selected.lcm"
        scenario.write_text(pathlib.Path(SCENARIO).read_text(encoding="utf-8") + """
  - {name: perception, config: 'detector: {color: {hue_min_deg: 200, hue_max_deg: 250}}'}
commands: [{command: takeoff, at_s: -6}, {command: select, at_px: [188, 115], at_s: -1}, {command: chase, at_s: -0.5}]
""", encoding="utf-8")
        answer = flight("--fault", "kill-perception@1", "--until", "6", "--log", log, "--light", scenario=scenario)
        self.assertEqual((answer.returncode, answer.stderr), (0, ""))
        tracked = [(utime * 1e-6 - START, data[lcmlog.after_head(data) + 4] == 1)
                   for utime, channel, data in lcmlog.read(log) if channel == "TARGET"]
        for begin, end, seen in ((-8, -1, False), (-0.9, 1, True), (1.5, 1.6, False), (4, 6, True)):
            self.assertEqual({tracks for t, tracks in tracked if begin < t < end}, {seen}, (begin, end))

    def test_scenario_tells_what_a_live_flight_needs(self):
        """deploy/fly's operator gives what the one in lockstep does, and processes fail when they do there."""
        scenario = self.folder / "told.yaml"
        scenario.write_text(pathlib.Path(SCENARIO).read_text(encoding="utf-8").replace("duration_s: 60", "duration_s: 12") + """
commands: [{command: select, at_px: [180, 119.5], at_s: -2}, {command: hold, at_s: 3}, {command: kill, at_s: 4.5}]
faults: [{name: lidar-gap}, {name: kill-planning, at: 5}, {name: delay-PLAN}, {name: loss-20}, {name: freeze-mapping}, {name: flood, at: -1}, {name: cpu-load}]
""", encoding="utf-8")
        answer = subprocess.run([BIN / "chase-scenario", scenario], capture_output=True, text=True, check=True, timeout=LIMIT)
        told = json.loads(answer.stdout)
        self.assertEqual((told["duration_s"], told["settle_s"]), (12.0, 8.0))
        kill, delay, loss, freeze, flood, load = told["faults"]
        self.assertEqual(kill, {"name": "kill-planning", "at_s": 5.0, "for_s": 0.5})
        self.assertEqual([(f["name"], f["for_s"], f["bus"]) for f in (delay, loss)],
                         [("delay-PLAN", 2.0, True), ("loss-20", 10.0, True)])
        self.assertEqual((freeze["name"], freeze["for_s"]), ("freeze-mapping", 2.0))
        self.assertEqual((flood["at_s"], flood["for_s"], flood["rate_hz"]), (-1.0, 2.0, 1000.0))
        self.assertLess({"PLAN", "LIDAR_SCAN", "COMMAND", "FAULT"}, set(flood["channels"]))
        self.assertEqual((load["name"], load["for_s"], load["times"]), ("cpu-load", 10.0, 5.0))
        answer = flight("--sensors", "raw", "--log", self.folder / "a.lcm", "--light", scenario=scenario)
        self.assertEqual((answer.returncode, answer.stderr), (2, ""), "its motors are cut: criteria are missed")
        self.assertIn(("freeze-mapping", 1, freeze["at_s"]), faults(self.folder / "a.lcm"))
        self.assertEqual([tuple(command.values()) for command in told["commands"]],
                         [("select", -2, ["180", "119.5"]), ("hold", 3, []), ("kill", 4.5, ["--force"])])

    def test_collision_ends_the_flight(self):
        """A block comes down the hall and through the hovering drone; planning hangs meanwhile."""
        text = pathlib.Path(SCENARIO).read_text(encoding="utf-8")
        scenario = self.folder / "ram.yaml"
        scenario.write_text(text.replace("settle_s: 8", "settle_s: 4") + """
faults: [{name: freeze-planning, at: 0, for: 50}]
movers:
  - {shape: box, size: [1, 3, 3], waypoints: [[-9, -2.1, 1.5], [20, -2.1, 1.5]], speed: 5}
""", encoding="utf-8")
        metrics = self.folder / "metrics.json"
        answer = flight("--sensors", "truth", "--end-on-collision", "--metrics", metrics,
                        scenario=scenario)
        self.assertEqual((answer.returncode, answer.stderr), (2, ""))
        self.assertRegex(answer.stdout, r"safe_ratio +FAILED")
        figures = json.loads(metrics.read_text(encoding="utf-8"))
        self.assertEqual(figures["collided_with"], "mover 1")
        self.assertEqual(figures["fault"], "freeze-planning")
        # From -9 m with its half length of 0.5 m to the drone at 1.7 m with its radius of 0.25 m.
        self.assertAlmostEqual(figures["collision_s"], (1.7 - 0.25 + 9 - 0.5) / 5, delta=0.25)
        self.assertAlmostEqual(figures["flown_s"], figures["collision_s"] + 0.2, delta=0.011)
        self.assertLess(figures["safe_ratio"], 1.0)
        self.assertFalse(figures["criteria"]["safe_ratio"])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
