"""chase-compare as its user meets it: campaign_test.py BIN_DIR. Python's standard library only."""

import csv
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

BIN = pathlib.Path(sys.argv[1])
ROOT = pathlib.Path(__file__).resolve().parents[2]
TWELVE = ROOT / "deploy/scenarios/twelve"


def compare(*arguments):
    return subprocess.run([BIN / "chase-compare", *map(str, arguments)], capture_output=True,
                          text=True, timeout=120, check=False)


class Campaign(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.out = pathlib.Path(folder.name)

    def fly(self, *arguments):
        answer = compare("--out", self.out, "--no-pictures", *arguments)
        self.assertEqual(answer.returncode, 0, answer.stderr)
        return answer

    def stamps(self):
        return {p.name: p.stat().st_mtime_ns for p in (self.out / "flights").iterdir()}

    def test_results_and_resuming(self):
        what = ["--planners", "chase,follow_behind", "--scenarios", "S1,S4", "--jobs", 2]
        answer = self.fly(*what)
        self.assertIn("4/4", answer.stderr)
        flights = json.loads((self.out / "flights.json").read_text())
        self.assertEqual([(f["scenario"], f["planner"]) for f in flights],
                         [("S1", "chase"), ("S1", "follow_behind"), ("S4", "chase"),
                          ("S4", "follow_behind")])
        for f in flights:
            self.assertEqual(f["seed"], 1)
            for key in ("safe_ratio", "visible_ratio", "distance_ratio", "travel_ratio",
                        "acceleration_cost", "jerk_cost", "yaw_rate_rms", "min_clearance_m"):
                self.assertIsInstance(f[key], float, key)
            self.assertEqual(set(f["plan_ms"]), {"mean", "p50", "p95", "p99", "max"})
            self.assertEqual(f["replans"], 100)
        rows = list(csv.DictReader((self.out / "flights.csv").read_text().splitlines()))
        self.assertEqual([float(r["acceleration_cost"]) for r in rows],
                         [f["acceleration_cost"] for f in flights])
        before = self.stamps()
        self.fly(*what)
        self.assertEqual(self.stamps(), before, "nothing was to be flown again")
        broken = self.out / "flights/S4_chase.json"
        broken.write_text("{")
        self.fly(*what)
        changed = {n for n, t in self.stamps().items() if t != before[n]}
        self.assertEqual(changed, {"S4_chase.json"})

    def test_flights_repeat(self):
        def figures():
            self.fly("--planners", "chase", "--scenarios", "S12")
            flight = json.loads((self.out / "flights/S12_chase.json").read_text())
            return flight["track"], flight["metrics"]["acceleration_cost"]
        first = figures()
        (self.out / "flights/S12_chase.json").unlink()
        self.assertEqual(figures(), first)

    def test_list_is_one_command_per_flight(self):
        lines = compare("--list", "--out", self.out, "--scenarios", "S1,S2",
                        "--planners", "penin_style:all").stdout.splitlines()
        self.assertEqual(len(lines), 40)
        subprocess.run(lines[0], shell=True, check=True, timeout=120)
        self.assertTrue((self.out / "flights/S1_penin_style-1.json").is_file())

    def test_default_is_four_planners_and_the_reference_on_twelve(self):
        lines = compare("--list").stdout.splitlines()
        self.assertEqual(len(lines), 60)
        for planner in ("chase", "hierarchical", "naegeli_style", "penin_style", "reference"):
            self.assertEqual(sum(f"--planners {planner} " in line for line in lines), 12, planner)

    def test_pictures(self):
        answer = compare("--out", self.out, "--planners", "chase", "--scenarios", "S3", "--quiet")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        for name in ("comparison.png", "top_view_S3.png"):
            self.assertTrue((self.out / name).read_bytes().startswith(b"\x89PNG"), answer.stderr)
        self.assertNotIn("arning", answer.stderr)
        if "no pictures" not in answer.stderr:  # without npm's Plotly there is no page
            self.assertIn("Plotly.newPlot", (self.out / "comparison.html").read_text())

    def test_bad_use_is_one_line(self):
        for arguments in (["--scenarios", "S13"], ["--scenarios", "deploy/scenarios"],
                          ["--planners", "penin_style:"], ["--planners", "nobody"], ["--jobs", "0"],
                          ["--planners", "penin_style:21"], ["--no-such"], ["--fly", "S1"],
                          ["--scenarios", "deploy/scenarios/gym.yaml", "--planners", "chase",
                           "--quiet"]):
            with self.subTest(arguments=arguments):
                answer = compare("--out", self.out, *arguments)
                self.assertEqual(answer.returncode, 1)
                self.assertTrue(answer.stderr.startswith("chase-compare: "), answer.stderr)
                self.assertEqual(answer.stderr.count("\n"), 1, answer.stderr)
                self.assertEqual(answer.stdout, "")

    def test_what_cannot_be_flown_is_said_before_the_first_flight(self):
        answer = compare("--out", self.out, "--scenarios", "S1,deploy/scenarios/gym.yaml",
                         "--planners", "chase")
        self.assertEqual(answer.returncode, 1)
        self.assertIn("upright ellipsoids", answer.stderr)
        self.assertEqual(list(self.out.iterdir()), [])

    def test_folder_that_cannot_be_is_said_before_the_first_flight(self):
        answer = compare("--out", "/proc/no/folder", "--scenarios", "S1", "--planners", "chase")
        self.assertEqual(answer.returncode, 1)
        self.assertRegex(answer.stderr, "^chase-compare: --out /proc/no/folder: .*\n$")

    def test_failed_flight_is_said_and_not_counted(self):
        (self.out / "flights/S1_follow_behind.json").mkdir(parents=True)  # cannot be written
        answer = compare("--out", self.out, "--scenarios", "S1", "--planners", "chase,follow_behind")
        self.assertEqual(answer.returncode, 1)
        self.assertIn(" 1/2 ", answer.stderr)
        self.assertNotIn(" 2/2 ", answer.stderr)
        self.assertIn("S1 follow_behind FAILED", answer.stderr)
        self.assertRegex(answer.stderr.splitlines()[-1],
                         "^chase-compare: the flight S1 follow_behind: .*cannot be written")

    def test_generator_makes_the_frozen_files(self):
        subprocess.run([sys.executable, "-B", TWELVE / "generate.py", "--out", self.out, "--only",
                        "S1,S10"], check=True, capture_output=True, timeout=120)
        made = sorted(p.name for p in self.out.iterdir())
        self.assertEqual(made, ["S01_target.csv", "S1.yaml", "S10.yaml", "S10_target.csv",
                                "map1.csv", "map4.csv"])
        for name in made:
            self.assertEqual((self.out / name).read_bytes(), (TWELVE / name).read_bytes(), name)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
