"""chase-campaign as its user meets it: campaign_test.py BIN_DIR. Flights are stand-ins of milliseconds,
but for one. Python's standard library only."""

import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

BIN = pathlib.Path(sys.argv[1]).resolve()
HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
DIFFERS = ("plan_ms", "predict_ms", "cpu_s", "real_time_factor")  # from run to run

SBATCH = """#!/bin/sh
set -e
for word; do
  case $word in
    --array=1-*) export SLURM_ARRAY_TASK_COUNT=3 ;;  # fewer tasks than flights
    --wrap=*) sh -c "${word#--wrap=}" > /dev/null ;;
    */flight.sbatch) script=$word ;;
    */flights.txt) for i in 1 2 3; do SLURM_ARRAY_TASK_ID=$i "$script" "$word" > /dev/null; done ;;
  esac
done
echo 7
"""


class Campaign(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.out, self.calls = self.folder / "out", self.folder / "calls"
        self.programs = self.stand_ins("bin")

    def stand_ins(self, name):
        folder = self.folder / name
        folder.mkdir()
        for program in ("flight", "world", "report"):
            shutil.copy(HERE / f"stand_in_{program}.py", folder / f"chase-{program}")
        return folder

    def command(self, *arguments, out=None, programs=None):
        return [BIN / "chase-campaign", "--programs", programs or self.programs, "--out",
                out or self.out, *map(str, arguments)]

    def run_it(self, *arguments, sleep=0, **where):
        return subprocess.run(self.command(*arguments, **where), capture_output=True, text=True,
                              cwd=self.folder, timeout=120, check=False,
                              env=self.environment(sleep))

    def environment(self, sleep):
        return dict(os.environ, STAND_IN_CALLS=str(self.calls), STAND_IN_SLEEP=str(sleep))

    def fly(self, *arguments, code=0, **where):
        answer = self.run_it(*arguments, **where)
        self.assertEqual(answer.returncode, code, answer.stderr + answer.stdout)
        return answer

    def flown(self):
        """How many flights were flown since the last call."""
        count = len(self.calls.read_text().splitlines()) if self.calls.exists() else 0
        self.calls.unlink(missing_ok=True)
        return count

    def results(self, out=None):
        """The flights without what differs from run to run, and the table."""
        flights = json.loads(((out or self.out) / "flights.json").read_text())
        for flight in flights:
            for key in DIFFERS:
                flight.pop(key, None)
        return flights, ((out or self.out) / "table.md").read_text()

    def test_rows_outcomes_and_lines_that_repeat(self):
        answer = self.fly("--scenarios", "gym", "--kinds", "hall", "--seeds", "1-4", "--faults",
                          "none,kill-planning@5")
        flights, table = self.results()
        self.assertEqual(len(flights), 16)
        self.assertEqual(self.flown(), 16)
        self.assertIn("16/16 12 failed", answer.stderr)
        self.assertEqual(answer.stdout, table)
        self.assertEqual([f["outcome"] for f in flights[:4]],
                         ["collision", "target_lost", "odometry_lost", "passed"])
        hall = flights[8]
        self.assertEqual((hall["kind"], hall["scenario"], hall["seed"], hall["fault"]),
                         ("hall", "hall-1", 1, ""))
        self.assertNotIn("kind", flights[0])
        self.assertEqual(flights[4]["fault"], "kill-planning@5")
        self.assertRegex(table, r"\| gym +\| kill-planning@5 \| 4 +\| 1 \(0\.05 to 0\.70\) \|")
        self.assertRegex(table, r"\| world:hall +\| +\| 4 ")
        self.assertRegex(table, r"\| all +\| +\| 16 +\| 4 \(0\.10 to 0\.49\) \|")
        self.assertIn("- gym, seed 1: collision with cylinder 3 at 12.25 s\n", table)
        self.assertIn("odometry lost, 3.25 m off; visible_ratio 0.400 too low", table)
        for flight in (flights[5], hall):
            line = flight["command"] + " --metrics again.json"
            subprocess.run(line, shell=True, cwd=self.folder, check=True, timeout=60)
            again = json.loads((self.folder / "again.json").read_text())
            for key in ("min_clearance_m", "distance_ratio", "visible_ratio", "flown_s"):
                self.assertEqual(again[key], flight[key], key)
        self.assertEqual((self.out / "worlds/hall-1.yaml").read_text(), "# hall 1 60\n")
        self.assertEqual(list((self.out / "flights").glob("*.work")), [])

    def row(self, table, *cells):
        """A row's cells by the titles of their columns."""
        titles, _, *rows = [[cell.strip() for cell in line.split("|")[1:-1]]
                            for line in table.splitlines() if line.startswith("|")]
        found, = [row for row in rows if tuple(row[:len(cells)]) == cells]
        return dict(zip(titles, found))

    def test_table_of_faults(self):
        self.fly("--scenarios", "gym", "--seeds", "3-5", "--faults", "none,kill-planning@5")
        _, table = self.results()
        none, killed = self.row(table, "gym", ""), self.row(table, "gym", "kill-planning@5")
        self.assertEqual((none["reaction, worst [s]"], none["recovery, worst [s]"]), ("-", "-"))
        self.assertEqual(none["non-finite setpoints"], "0")
        self.assertEqual(killed["reaction, worst [s]"], "0.050")
        self.assertEqual(killed["recovery, worst [s]"], "1.000, 1 never")
        self.assertEqual(killed["non-finite setpoints"], "12")
        self.assertEqual([killed[of] for of in ("plans in the air", "uncertified brakes", "accelerating brakes")],
                         ["3000", "12", "0"])
        for title, cell in (("certificate kept, mean", "0.980"), ("travel ratio, mean", "1.020"),
                            ("in image, mean", "1.000"), ("visible, worst", "0.400")):
            self.assertEqual(killed[title], cell, title)
        self.assertEqual(self.row(table, "all", "")["non-finite setpoints"], "12")
        self.fly("--scenarios", "gym,forest", "--seeds", "3-5", "--faults", "none,kill-planning@5,kill-control,gust@5")
        _, table = self.results()
        self.assertEqual(self.row(table, "all", "kill-P")["flights"], "12")
        self.assertEqual(self.row(table, "all", "gust@5")["non-finite setpoints"], "24")
        self.assertEqual(self.row(table, "all", "")["flights"], "24")

    def test_failed_flights_have_reports(self):
        self.fly("--seeds", "1-4,12,14")
        flights, table = self.results()
        report = {f["seed"]: f.get("report") for f in flights}
        self.assertEqual(report, {1: "reports/gym_1/report.html", 2: "reports/gym_2/report.html",
                                  3: "reports/gym_3/report.html", 4: None, 12: None, 14: None},
                         "4 passed, 12 has a report that fails, 14 died")
        self.assertRegex(table, r"gym, seed 2: .*\n  \[report\]\(reports/gym_2/report.html\), `\S*chase-flight \S+ --seed 2 ")
        self.assertEqual((self.out / report[2]).read_text(), "log of seed 2")
        self.assertEqual(sorted(path.name for path in (self.out / "reports").iterdir()), ["gym_1", "gym_2", "gym_3"])
        self.assertEqual(list(self.out.rglob("*.lcm")), [])
        self.fly("--seeds", "1-4")
        self.assertEqual(self.results()[0][1]["report"], report[2], "what is not flown again keeps its own")
        path = self.programs / "chase-flight"
        path.write_text(path.read_text().replace("seed % 10 == 2:", "seed % 10 == 4:"))
        self.fly("--seeds", "1-4")
        self.assertEqual([f.get("report") for f in self.results()[0]],
                         [report[1], None, report[3], "reports/gym_4/report.html"])
        (self.programs / "chase-report").unlink()
        self.fly("--seeds", "1-4", out=self.folder / "bare")
        self.assertNotIn("report", self.results(self.folder / "bare")[0][0])

    def test_user_is_told_that_a_scenarios_map_is_one(self):
        self.assertRegex(self.fly("--scenarios", "forest,gym", "--seeds", "4-5").stderr,
                         r"^chase-campaign: note: \S*forest.yaml has the same map with every seed.*--kinds forest")
        for what in (["--scenarios", "forest", "--seeds", "4"], ["--seeds", "4-5"],
                     ["--kinds", "forest", "--seeds", "4-5"]):
            self.assertNotIn("note", self.fly(*what).stderr)

    def test_only_what_is_not_done_is_flown(self):
        scenario = self.folder / "mine.yaml"
        text = (ROOT / "deploy/scenarios/gym.yaml").read_text()
        scenario.write_text(text)

        def flown(*arguments, seeds="4-6"):
            self.fly("--scenarios", scenario, "--seeds", seeds, *arguments)
            return self.flown()
        self.assertEqual([flown(), flown()], [3, 0])
        self.assertEqual(flown(seeds="4-7"), 1)
        self.assertEqual(flown("--faults", "none,lidar-gap"), 3)
        self.assertEqual([flown("--duration", 30), flown("--duration", 30)], [3, 0])
        self.assertEqual([flown("--duration", 30, "--fly-on"), flown()], [3, 3])
        scenario.write_text(text + "# another text\n")
        self.assertEqual(flown(), 3)
        with (self.programs / "chase-flight").open("a") as program:
            program.write("# another program\n")
        self.assertEqual(flown(), 3)
        (self.out / "flights/mine_5.json").write_text("{")
        self.assertEqual(flown(), 1)

    def test_killed_and_resumed_is_the_same(self):
        what = ["--kinds", "hall,crowd", "--seeds", "1-6", "--jobs", 2]
        self.fly(*what, out=self.folder / "whole")
        self.flown()
        run = subprocess.Popen(self.command(*what), env=self.environment(0.1), start_new_session=True,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while not self.calls.exists() or len(self.calls.read_text().splitlines()) < 4:
            time.sleep(0.01)
        self.assertRegex(self.fly(*what, code=1).stderr, "^chase-campaign: .* another campaign's.*\n$")
        run.send_signal(signal.SIGKILL)
        run.wait()
        time.sleep(0.3)  # what was in the air ends with it
        before = self.flown()
        self.assertLess(before, 8)
        self.assertFalse((self.out / "flights.json").exists())
        self.fly(*what)
        self.assertLess(self.flown(), 12)
        self.assertEqual(self.results(), self.results(self.folder / "whole"))
        self.assertEqual(list((self.out / "flights").glob("*.work")), [])

    def test_all_faults_are_those_that_can_strike_the_place(self):
        lines = self.fly("--list", "--scenarios", "gym", "--faults", "all").stdout.splitlines()
        for fault, times in (("decoy", 1), ("loss-20", 1), ("delay-PLAN", 1), ("cpu-load", 1), ("disk-full", 0),
                             ("kill-mission", 1)):
            self.assertEqual(sum(f"--faults {fault} " in line for line in lines), times, fault)

    def test_list_through_a_shell_is_the_same(self):
        what = ["--kinds", "hall", "--scenarios", "gym", "--seeds", "1,4,14,19", "--faults",
                "none,freeze-odometry", "--duration", 30]
        self.fly(*what, out=self.folder / "direct")
        lines = self.fly("--list", *what).stdout
        self.assertEqual(len(lines.splitlines()), 16)
        self.flown()
        subprocess.run(["xargs", "-P", "2", "-d", "\n", "-n", "1", "sh", "-c"], input=lines, text=True,
                       cwd="/", check=True, timeout=60, env=self.environment(0))
        self.assertEqual(self.flown(), 14)  # two have no world
        subprocess.run(["sh", "-e"], input=lines, text=True, cwd="/", check=True, timeout=60,
                       env=self.environment(0))
        self.fly(*what)
        self.assertEqual(self.flown(), 0, "what is done is not flown again")
        self.assertEqual(self.results(), self.results(self.folder / "direct"))

    def test_crashed_and_malformed_flights_are_counted(self):
        self.fly("--seeds", "4,14-18")
        flights, table = self.results()
        why = {f["seed"]: f["why"] for f in flights}
        self.assertEqual([f["outcome"] for f in flights], ["passed"] + 5 * ["error"])
        self.assertIn("chase-flight: ended by signal 11", why[14])
        self.assertIn("no luck today; cure: another seed", why[15])
        self.assertIn("no JSON", why[16])
        self.assertIn("malformed metrics.json: no number flown_s", why[17])
        self.assertIn("wrote no metrics", why[18])
        self.assertRegex(table, r"\| gym +\| +\| 6 +\| 1 \(0.03 to 0.56\) ")
        self.assertEqual(table.count("ended by an error"), 5)
        self.fly("--kinds", "hall", "--seeds", "19")
        self.assertIn("chase-world: no way through", self.results()[0][0]["why"])

    def test_flight_ended_from_outside_leaves_no_result(self):
        answer = self.fly("--seeds", "4,24", code=1)
        self.assertRegex(answer.stderr.splitlines()[-1], "^chase-campaign: the flight gym_24: was told")
        self.assertEqual([p.name for p in (self.out / "flights").iterdir()], ["gym_4.json"])

    def test_device_is_not_replaced(self):
        pipe = self.folder / "pipe"
        os.mkfifo(pipe)
        self.out.mkdir()
        (self.out / "table.md").symlink_to(pipe)
        self.assertIn("table.md: cannot be written", self.fly("--seeds", "4", code=1).stderr)
        self.assertTrue(pipe.is_fifo())
        self.assertEqual([p.name for p in self.out.glob("*.tmp")], [])

    def test_sentinels_and_cluster(self):
        """deploy/slurm/submit with a stand-in for sbatch that flies at once."""
        lines = self.fly("--list", "--flights", HERE / "sentinels.csv").stdout.splitlines()
        self.assertEqual(len(set(lines)), 48)
        sbatch = self.folder / "tools" / "sbatch"
        sbatch.parent.mkdir()
        sbatch.write_text(SBATCH)
        sbatch.chmod(0o755)
        what = ["--seeds", "1-4", "--faults", "none,lidar-gap"]
        self.fly(*what, out=self.folder / "direct")
        environment = self.environment(0)
        environment.update(PATH=f"{sbatch.parent}:{environment['PATH']}", CHASE_BIN=str(BIN))
        submit = [ROOT / "deploy/slurm/submit", "chase-campaign", self.out, *what, "--programs",
                  self.programs]
        answer = subprocess.run(submit, capture_output=True, text=True, check=False, timeout=60,
                                cwd=self.folder, env=environment)
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertEqual(self.flown(), 16, "each once here and once there")
        self.assertEqual(self.results(), self.results(self.folder / "direct"))

    def test_duration_judges_the_part_that_was_asked_for(self):
        self.fly("--seeds", "4,1", "--duration", 30)
        self.assertEqual([f["outcome"] for f in self.results()[0]], ["passed", "collision"])
        lines = self.calls.read_text().splitlines()
        self.assertTrue(all("--until 30" in line and "--end-on-collision" in line for line in lines))
        self.flown()
        self.fly("--seeds", "4", "--duration", 30, "--fly-on", "--kinds", "yard")
        calls = self.calls.read_text()
        for always in ("--seed", "--quiet", "--metrics", "--log", "--light"):
            calls = calls.replace(always, "")
        self.assertNotIn("--", calls)
        self.assertEqual((self.out / "worlds/yard-4.yaml").read_text(), "# yard 4 30\n")

    def worse(self):
        """Programs whose flights with an even seed hit something."""
        programs = self.stand_ins("worse")
        path = programs / "chase-flight"
        path.write_text(path.read_text().replace("seed % 10 == 1:", "seed % 2 == 0:"))
        return programs

    def test_comparison(self):
        what = ["--kinds", "hall,yard", "--seeds", "30-50", "--quiet"]
        before, worse = self.folder / "before", self.worse()
        self.fly(*what, out=before, programs=worse)
        self.fly(*what, "--compare", before, out=before, programs=worse)
        answer = self.fly(*what, "--compare", before, "--baseline", self.folder / "slim.json")
        self.assertIn("Verdict: nothing worse beyond chance; better: ", answer.stdout)
        for old in (self.out, self.out / "flights.json", self.folder / "slim.json"):
            again = self.fly(*what, "--compare", old, code=0).stdout
            self.assertIn("all: 42 pairs, no change\nVerdict: nothing worse beyond chance\n", again)
            answer = self.fly(*what, "--compare", old, code=3, out=before, programs=worse).stdout
            self.assertRegex(answer, r"world:hall: 21 pairs\n  passed +1\d of 21 .* -> 8 of 21 ")
            self.assertRegex(answer, r"all: 42 pairs\n  passed .*: worse, p [0-9.e-]+, beyond chance\n")
            self.assertIn("hall-34, seed 34: passed -> collision (collision with cylinder 3", answer)
            self.assertRegex(answer, r"Verdict: WORSE: .*passed of all")
        other = ["--kinds", "hall,yard", "--seeds", "130-150", "--quiet"]
        answer = self.fly(*other, "--compare", self.out, code=3, out=self.folder / "other",
                          programs=worse).stdout
        self.assertIn("all: 42 flights before, 42 now, no pairs", answer)
        mixed = self.fly("--kinds", "hall,park", "--seeds", "230-250", "--quiet", "--compare", self.out,
                         out=self.folder / "mixed").stdout
        self.assertIn("world:hall: 21 flights before, 21 now, no pairs", mixed)
        self.assertIn("world:park: not flown before\n", mixed)
        self.assertNotIn("\nall: ", mixed.partition("Against")[2], "halls are not compared with parks")
        self.fly("--kinds", "park", "--compare", self.out, out=self.folder / "park")

    def test_flights_from_a_list(self):
        path = self.folder / "list.csv"
        path.write_text("# place, seed, fault\n\nworld:forest, 4, kill-mapping  # a comment\nforest,5\n"
                        "gym,4,none\nworld:forest,4,kill-mapping\n")
        self.fly("--flights", path)
        self.assertEqual([(f["scenario"], f.get("kind"), f["seed"], f["fault"])
                          for f in self.results()[0]],
                         [("forest-4", "forest", 4, "kill-mapping"), ("forest", None, 5, ""),
                          ("gym", None, 4, "")])
        for text, words in (("gym,4\nworld:lake,1\n", ":2: no kind of world 'lake'"),
                            ("gym\n", ":1: 'gym' is not scenario,seed,fault"),
                            ("gym,x\n", ":1: .*'x' is no seed"),
                            ("gym,1,kill-joy\n", ":1: fault 'kill-joy': .*one of .*kill-planning"), ("#\n", "no flights")):
            path.write_text(text)
            self.assertRegex(self.fly("--flights", path, code=1).stderr, words)

    def test_bad_use_is_one_line(self):
        twin = self.folder / "gym.yaml"
        twin.write_text("name: other\ntarget: {waypoints: [[0, 0], [5, 5]]}\n")
        broken = self.folder / "broken.yaml"
        broken.write_text("name: broken\nno_such_key: 1\n")
        for arguments, words in (
                (["--scenarios", "no-such"], "no scenario 'no-such'"),
                (["--scenarios", broken], "no_such_key"),
                (["--scenarios", f"gym,{twin}"], "same name"),
                (["--kinds", "lake"], "no kind of world 'lake'.*hall, office"),
                (["--faults", "kill-joy"], "fault 'kill-joy': .*one of .*kill-planning"),
                (["--faults", "kill-planning@soon"], "'soon' is no mission time"),
                (["--faults", "kill-planning@nan"], "'nan' is no mission time"),
                (["--seeds", "5-1"], "'5-1'"), (["--seeds", ""], "seeds ''"),
                (["--seeds", "1,,2"], "'' is no seed"), (["--seeds", "1-99999999999"], "99999999999"),
                (["--seeds", "0-2147483647"], "range"), (["--duration", "nan"], "nan"),
                (["--jobs", "0"], "--jobs"), (["--no-such"], "--no-such"),
                (["--flights", "no/such.csv"], "no/such.csv"), (["--flights", twin, "--seeds", "1"], "--flights"),
                (["--compare", "no/such"], "no/such"), (["--compare", twin], "is no list of flights"),
                (["--fly", "--seeds", "1-2"], "--fly takes one flight")):
            with self.subTest(arguments=arguments):
                answer = self.run_it(*arguments)
                self.assertEqual(answer.returncode, 1, answer.stderr)
                self.assertEqual(answer.stderr.count("\n"), 1, answer.stderr)
                self.assertRegex(answer.stderr, "^chase-campaign: ")
                self.assertRegex(answer.stderr, words)
                self.assertEqual(answer.stdout, "")
        self.assertEqual(self.flown(), 0)
        answer = self.run_it(programs=self.folder)
        self.assertRegex(answer.stderr, "^chase-campaign: .*/chase-flight: no such program; .*\n$")
        answer = self.run_it(out="/proc/no/folder")
        self.assertRegex(answer.stderr.splitlines()[-1], "^chase-campaign: --out /proc/no/folder: ")

    @unittest.skipUnless((BIN / "chase-world").exists(), "skipped: this build has no chase-world")
    def test_kinds_are_those_of_chase_world(self):
        text = subprocess.run([BIN / "chase-world", "--help"], capture_output=True, text=True,
                              check=True).stdout
        kinds = re.findall(r"^  (\w+) ", text.partition("Kinds:\n")[2], re.MULTILINE)
        lines = self.fly("--list", "--kinds", "all").stdout.splitlines()
        self.assertEqual([re.search(r"--kinds (\w+)", line)[1] for line in lines],
                         [kind for kind in kinds if kind != "all"])

    @unittest.skipUnless((BIN / "chase-flight").exists(), "skipped: this build has no chase-flight")
    def test_real_flight(self):
        self.fly("--scenarios", "gym", "--duration", 1, "--fly-on", programs=BIN)
        (flight,), _ = self.results()
        self.assertEqual(flight["outcome"], "passed", flight["why"])
        for key in ("safe_ratio", "min_clearance_m", "visible_ratio", "distance_ratio", "travel_ratio", "in_image_ratio"):
            self.assertIsInstance(flight[key], float, key)
        self.assertRegex(flight["command"], r"chase-flight .*gym\.yaml --seed 1 --until 1$")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
