"""test/flight/bars: which campaigns keep their bars, and which do not."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

BARS = pathlib.Path(__file__).resolve().parent / "bars"


def flights(n, scenario="forest", **figures):
    """Of as many seeds; a random world carries its seed in its name."""
    return [{"scenario": f"{scenario}-{seed}", "seed": seed, "collision_s": -1.0, "certificate_kept_ratio": 1.0,
             "tracking_error_p99_m": 0.05, "reaction_s": None, "nonfinite_setpoints": 0, **figures} for seed in range(n)]


class Bars(unittest.TestCase):
    def judged(self, name, own):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "flights.json").write_text(json.dumps(own), encoding="utf-8")
            return subprocess.run([sys.executable, BARS, name, folder], capture_output=True, text=True, check=False)

    def test_all_kept(self):
        answer = self.judged("kept", flights(20))
        self.assertEqual((answer.returncode, answer.stderr), (0, ""))
        self.assertRegex(answer.stdout, r"(?m)^kept +forest +collisions, at most 0 +0 \(of 20, 0.000 to 0.161\)$")

    def test_each_bar_is_missed_by_what_breaks_it(self):
        for figure, value in (("collision_s", 3.0), ("certificate_kept_ratio", 0.0), ("tracking_error_p99_m", 0.13)):
            own = flights(20)
            own[7][figure] = value
            self.assertEqual(self.judged("kept", own).returncode, 3, figure)
        self.assertEqual(self.judged("kept", flights(19)).returncode, 3, "too few")
        self.assertEqual(self.judged("kept", flights(20) + flights(19, "hall")).returncode, 3, "too few of one kind")

    def test_a_fault_that_was_never_felt_has_no_reaction(self):
        self.assertEqual(self.judged("faults", flights(3)).returncode, 0)
        self.assertEqual(self.judged("faults", flights(3) + flights(1, reaction_s=0.21)).returncode, 3)

    def test_each_fault_counts_for_itself(self):
        own = [dict(flight, fault=f"{fault}@{k}") for fault in ("gust", "decoy") for k, flight in enumerate(flights(3))]
        self.assertEqual(self.judged("faults", own).returncode, 0)
        self.assertEqual(self.judged("faults", own[:-1]).returncode, 3, "two of a kind")

    def test_a_flight_that_ended_in_an_error_is_none(self):
        own = flights(20)
        own.append({"scenario": "forest-20", "seed": 20, "outcome": "error"})
        self.assertEqual(self.judged("kept", own).returncode, 3)

    def test_a_campaign_that_has_not_ended_is_named(self):
        answer = subprocess.run([sys.executable, BARS, "kept", "/nowhere"], capture_output=True, text=True, check=False)
        self.assertEqual(answer.returncode, 2)
        self.assertIn("/nowhere/flights.json is not there", answer.stderr)


if __name__ == "__main__":
    unittest.main()
