#!/usr/bin/env python3
"""Missions that the safety envelope ends: battery low and critical, geofence, kill, a blocked way up or down.

envelope_test.py BIN_DIR MISSION.yaml"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

BIN, MISSION = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "replay"))
import lcmlog  # noqa: E402

TAKEOFF_X = 1.7  # m: the scenario's start


def fly(folder, commands, duration, **changes):
    """Flies the mission changed: services by name, boxes, movers, faults; returns metrics and the log's path."""
    blocks = dict(re.findall(r"^(\w+):(.*?)(?=^\w+:|\Z)", MISSION.read_text(encoding="utf-8"), re.M | re.S))
    blocks["commands"] = json.dumps([{"command": name, "at_s": t} for name, t in commands])
    blocks["duration_s"] = str(duration)
    blocks["criteria"] = '{"safe_ratio": -1, "visible_ratio": -1, "in_image_ratio": -1}'
    for name, config in changes.get("services", {}).items():
        blocks["services"] += f"  - {{name: {name}, config: '{json.dumps(config)}'}}\n"
    blocks["world"] = f"\n  boxes: {json.dumps(changes.get('boxes', []))}{blocks['world']}"
    blocks["movers"], blocks["faults"] = (json.dumps(changes.get(key, [])) for key in ("movers", "faults"))
    text = "".join(f"{key}: {block.rstrip()}\n" for key, block in blocks.items())
    file, log = folder / "mission.yaml", folder / "flight.lcm"
    file.write_text(text, encoding="utf-8")
    run = subprocess.run([BIN / "chase-flight", file, "--seed", "1", "--quiet", "--sensors", "truth",
                          "--metrics", folder / "m.json", "--log", log],
                         capture_output=True, text=True, check=False)
    if not (folder / "m.json").exists():
        raise AssertionError(run.stderr)
    return json.loads((folder / "m.json").read_text(encoding="utf-8")), log


def reasons(log):
    """The words of FLIGHT_STATE in the order in which they were said first."""
    said = []
    for _, channel, data in lcmlog.read(log):
        if channel != "FLIGHT_STATE":
            continue
        at = lcmlog.after_head(data) + 5  # epoch, state
        text = data[at + 4:at + 4 + int.from_bytes(data[at:at + 4], "big") - 1].decode()
        if text not in said:
            said.append(text)
    return said


class Envelope(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def fly(self, commands, duration=20, **changes):
        metrics, log = fly(pathlib.Path(self.folder.name), commands, duration, **changes)
        self.reasons = reasons(log)
        return [s["state"] for s in metrics["flight_states"]], metrics, log

    def test_heights_in_which_nothing_is_listed_are_refused(self):
        with self.assertRaisesRegex(AssertionError, r"z_max is \S+ m.*up to statics.band_high 2 m only.* to \S+ m"):
            self.fly([], 1, services={"mapping": {"statics": {"band_high": 2.0}}})

    def truth(self, log, channel="TRUTH", *columns):
        """(t, x, z) of TRUTH, s and m, or other columns."""
        out = pathlib.Path(self.folder.name) / "truth.tum"
        export = subprocess.run([BIN / "chase-log", "export", "--tum", "--channel", channel, log, out],
                                check=False, capture_output=True, text=True)
        self.assertEqual(export.returncode, 0, export.stderr)
        rows = [line.split() for line in out.read_text(encoding="utf-8").splitlines() if line[0] != "#"]
        return [(float(row[0]), *(float(row[i]) for i in columns or (1, 3))) for row in rows]

    def assert_in_order(self, states, *expected):
        rest = iter(states)
        for state in expected:
            self.assertIn(state, rest, states)

    def test_low_battery_returns_and_lands(self):
        states, _, _ = self.fly([("takeoff", -7), ("chase", -2)], 30, services={
            "simulator": {"battery": {"endurance": 60, "charge": 0.5}}, "mission": {"battery_critical": 0}})
        self.assert_in_order(states, "TAKEOFF", "CHASE", "RETURN", "LAND", "DONE")
        self.assertIn("battery low", self.reasons)

    def test_critical_battery_lands_here(self):
        states, _, _ = self.fly([("takeoff", -7), ("chase", -2)], 20, services={
            "simulator": {"battery": {"endurance": 60, "charge": 0.4}},
            "mission": {"battery_low": 0.2, "battery_critical": 0.2}})
        self.assert_in_order(states, "CHASE", "LAND", "DONE")
        self.assertIn("battery critical: landing here", self.reasons)

    def test_low_battery_is_not_ready(self):
        states, _, _ = self.fly([("takeoff", -7)], 2, services={
            "simulator": {"battery": {"charge": 0.2}}})
        self.assertNotIn("TAKEOFF", states)

    def test_geofence_is_held_inside(self):
        reach = 5.0
        states, _, log = self.fly([("takeoff", -7), ("chase", -2), ("return", 12)], 30, services={
            "mission": {"geofence": {"polygon": [[-3, -3], [reach, -3], [reach, 8], [-3, 8]]}}})
        self.assert_in_order(states, "CHASE", "HOLD", "RETURN", "LAND", "DONE")
        self.assertTrue(any("geofence" in reason for reason in self.reasons), self.reasons)
        farthest = max(x for _, x, _ in self.truth(log)) - TAKEOFF_X
        self.assertLess(farthest, reach)
        self.assertGreater(farthest, 0.6 * reach, "it did not even go near")

    def test_control_keeps_the_fence_by_itself(self):
        reach = 5.0
        states, _, log = self.fly([("takeoff", -7), ("chase", -2)], 15, services={
            "control": {"geofence": {"polygon": [[-3, -3], [reach, -3], [reach, 8], [-3, 8]]}}})
        self.assertEqual(states[-1], "CHASE")  # mission knows no fence
        farthest = max(x for _, x, _ in self.truth(log)) - TAKEOFF_X
        self.assertLess(farthest, reach)
        self.assertGreater(farthest, 0.6 * reach, "it did not even go near")

    def test_return_and_landing_go_on_when_a_process_dies(self):
        for command, dies in (("return", 9.5), ("land", 8.2)):
            for name in ("mission", "planning", "control"):
                with self.subTest(command=command, name=name):
                    states, metrics, _ = self.fly([("takeoff", -7), ("chase", -2), (command, 8)], 30,
                                                  faults=[{"name": f"kill-{name}", "at": dies}])
                    anew = name == "mission"
                    again = ["IDLE", command.upper()] if anew else []
                    self.assertEqual(metrics["restarts"], {name: 1})
                    self.assert_in_order(states, "CHASE", command.upper(), *again, "DONE")
                    # A descent is not even held up.
                    self.assertEqual("HOLD" in states[states.index(command.upper()):], anew and command == "return", states)
                    self.assertEqual(any("before this process started" in reason for reason in self.reasons), anew)
                    self.assertEqual(metrics["safe_ratio"], 1.0)
                    self.assertLess(metrics["touchdown_speed_mps"], 0.75)  # as fast as control sinks without a velocity

    def test_lands_beside_what_has_come_below(self):
        states, metrics, log = self.fly([("takeoff", -7), ("land", 8)], 22, movers=[
            {"shape": "box", "size": [0.8, 0.8, 0.4], "times": [0, 5, 100],
             "waypoints": [[1.7, 1.5, 0.2], [1.7, -2.1, 0.2], [1.7, -2.1, 0.2]]}])
        self.assert_in_order(states, "TAKEOFF", "HOLD", "LAND", "DONE")
        self.assertTrue(any("to a free place" in reason for reason in self.reasons), self.reasons)
        x, y = self.truth(log, "TRUTH", 1, 2)[-1][1:]
        self.assertGreater(max(abs(x - 1.7), abs(y + 2.1)), 0.4 + 0.25 + 0.2)
        self.assertEqual(metrics["safe_ratio"], 1.0)

    def test_kill_cuts_the_motors_in_the_air(self):
        states, _, log = self.fly([("takeoff", -7), ("chase", -2), ("kill", 4), ("hold", 6)], 8)
        self.assert_in_order(states, "CHASE", "DONE")
        self.assertEqual(states[-1], "DONE")
        self.assertIn("killed: motors cut by command", self.reasons)
        rows = self.truth(log)
        fall = max((a[2] - b[2]) / (b[0] - a[0]) for a, b in zip(rows, rows[1:]))
        self.assertGreater(fall, 2.0, "it fell")

    def test_what_hangs_above_stands_against_take_off(self):
        states, _, _ = self.fly([("takeoff", -7)], 2, boxes=[
            {"center": [1.7, -2.1, 1.2], "size": [0.6, 0.6, 0.2]}])
        self.assertEqual(set(states), {"IDLE"}, self.reasons)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
