"""chase-log and chase-report as a user calls them, on the log of a short flight.

logs_cli_test.py BIN_DIR"""

import csv
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test/replay"))
sys.dont_write_bytecode = True
import every_channel  # noqa: E402
import lcmlog  # noqa: E402

BIN = pathlib.Path(sys.argv[1]).resolve()
sys.path.insert(0, str(BIN.parent / "share/chase/python"))
import chase  # noqa: E402

LIMIT = 240  # s: a loaded machine is slow to write
HEAVY = ("LIDAR_SCAN", "CAMERA_IMAGE", "SCAN_REGISTERED", "MAP")


def run(program, *arguments):
    return subprocess.run([BIN / program, *map(str, arguments)], capture_output=True, text=True,
                          timeout=LIMIT, check=False)


class LogTools(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.log = cls.folder / "flight.lcm"
        answer = run("chase-flight", ROOT / "deploy/scenarios/gym.yaml", "--until", "1", "--quiet",
                     "--log", cls.log)
        assert answer.returncode == 0, answer.stderr
        cls.events = cls.thinned(lcmlog.read(cls.log))
        lcmlog.write(cls.log, cls.events)

    @staticmethod
    def thinned(events):
        """Few of the clouds and images, so that the tests are quick."""
        counts, kept = {}, []
        for event in events:
            counts[event[1]] = counts.get(event[1], 0) + 1
            if event[1] not in HEAVY or counts[event[1]] <= 5:
                kept.append(event)
        return kept

    @staticmethod
    def cksum(*service):
        dump = run(*service, "--dump-config")
        assert dump.returncode == 0, dump.stderr
        return subprocess.run(["cksum"], input=dump.stdout, capture_output=True, text=True, check=True).stdout.split()[0]

    def good(self, *arguments):
        answer = run("chase-log", *arguments)
        self.assertEqual(answer.returncode, 0, answer.stderr)
        return answer.stdout

    def assert_refused(self, answer, code, *words):
        self.assertEqual(answer.returncode, code, answer.stderr)
        self.assertEqual(answer.stderr.count("\n"), 1, f"not one line: {answer.stderr!r}")
        for word in words:
            self.assertIn(str(word), answer.stderr)

    def count(self, channel):
        return sum(name == channel for _, name, _ in self.events)

    def test_tum_holds_the_channel_that_is_named(self):
        texts = {}
        for channel in ("POSE", "TRUTH", "TARGET"):
            out = self.folder / f"{channel}.tum"
            self.good("export", "--tum", "--channel", channel, self.log, out)
            texts[channel] = out.read_text()
            self.assertLessEqual(len(texts[channel].splitlines()), self.count(channel))
        self.assertEqual(len(set(texts.values())), 3, "two channels give one trajectory")
        events, poses, log = [], 0, self.folder / "epochs.lcm"
        for utime, channel, data in self.events:
            if channel == "POSE":
                pose, poses = chase.pose_t.decode(data), poses + 1
                if poses == 101:
                    changed = pose.utime
                pose.epoch = 9 if poses > 100 else 7
                data = pose.encode()
            events.append((utime, channel, data))
        lcmlog.write(log, events)
        answer = run("chase-log", "export", "--tum", log, self.folder / "epochs.tum")
        self.assertEqual(answer.stderr, f"{log}: frame W changed at {changed * 1e-6:.6f} s (epoch 9)\n")
        self.assertEqual(len(texts["TRUTH"].splitlines()), self.count("TRUTH"))
        self.good("export", "--tum", self.log, self.folder / "default.tum")
        self.assertEqual((self.folder / "default.tum").read_text(), texts["POSE"])

    def test_tum_of_a_target_that_was_never_tracked_says_so(self):
        log, events = self.folder / "untracked.lcm", []
        for utime, channel, data in self.events:
            if channel == "TARGET":
                target = chase.target_t.decode(data)
                target.state = target.SEARCHING
                data = target.encode()
            events.append((utime, channel, data))
        lcmlog.write(log, events)
        answer = run("chase-log", "export", "--tum", "--channel", "TARGET", log, self.folder / "untracked.tum")
        self.assert_refused(answer, 1, f"{log}: none of {self.count('TARGET')} messages of TARGET is of a target that is tracked\n")

    def test_options_without_effect_are_refused(self):
        out = self.folder / "refused"
        for words, arguments in (
                (("--channel", "IMU", "POSE"), ("--tum", "--channel", "IMU")),
                (("--channel", "NO_SUCH", "info"), ("--csv", "--channel", "NO_SUCH")),
                (("--channel", "NO_SUCH", "info"), ("--mcap", "--channel", "NO_SUCH")),
                (("--jpeg", "no image"), ("--mcap", "--jpeg", "--channel", "POSE")),
                (("--rig", "neither POSE nor an image"), ("--mcap", "--rig", self.rig(), "--channel", "IMU"))):
            with self.subTest(arguments=arguments):
                answer = run("chase-log", "export", *arguments, self.log, out)
                self.assert_refused(answer, 2, *words)
                self.assertFalse(out.exists())

    def test_two_vehicles_are_no_flight(self):
        log, one = self.folder / "two.lcm", self.folder / "one.lcm"
        for lost in ((), ("TRUTH", "SCENARIO")):
            lcmlog.write(log, [(utime, prefix + channel, data) for utime, channel, data in self.events
                               if channel not in lost for prefix in ("", "eagle_")])
            for program in (["chase-report"], ["chase-log", "identify"]):
                self.assert_refused(run(*program, log), 1, "two.lcm: holds ", " of several vehicles; keep one with chase-log filter")
            self.assert_refused(run("chase-log", "verify", log), 2, "two.lcm: holds ", " of several vehicles; keep one with chase-log filter")
            out = self.folder / "two.mcap"
            self.assert_refused(run("chase-log", "export", "--mcap", log, out), 1, "of several vehicles; keep one")
            self.assertFalse(out.exists())
        self.good("export", "--mcap", "--channel", "eagle_POSE", log, self.folder / "eagle.mcap")
        self.good("filter", log, one, "--keep", "eagle_*")
        self.assertEqual(run("chase-report", one, "--out", self.folder / "one").returncode, 0)
        self.assertEqual(self.good("verify", one), self.good("verify", self.log))

    def without(self, name, lost):
        """A log that lacks the messages of which lost(channel, k) is true for the channel's k-th."""
        counts, kept = {}, []
        for event in self.events:
            k = counts[event[1]] = counts.get(event[1], -1) + 1
            if not lost(event[1], k):
                kept.append(event)
        lcmlog.write(self.folder / name, kept)
        return self.folder / name

    def test_lost_messages_are_counted(self):
        whole = self.good("info", self.log)
        self.assertNotIn("are missing", whole)
        self.assertIn("gym, seed 1", whole)
        self.assertIn("versions", whole)
        log = self.without("lost.lcm", lambda channel, k: channel == "IMU" and 100 <= k < 150 or
                           channel == "TRUTH" and k < 30)
        text = self.good("info", log)
        self.assertIn(f"IMU: 50 of {self.count('IMU')} messages of simulator are missing", text)
        self.assertIn(f"TRUTH: 30 of {self.count('TRUTH')} messages of simulator are missing", text)
        imu = next(line for line in text.splitlines() if line.startswith("IMU")).split()
        self.assertEqual(imu[-2:], ["50", "0.255"])  # 51 periods of 5 ms

    def test_messages_that_cannot_be_read_are_no_record(self):
        log = self.folder / "zeroed.lcm"
        lcmlog.write(log, [(utime, channel, bytes(len(data)) if channel == "IMU" else data) for utime, channel, data in self.events])
        line = f"IMU: {self.count('IMU')} messages cannot be read (of another version, or damaged; see chase-log migrate)\n"
        self.assertIn(line, self.good("info", log))
        answer = run("chase-report", log, "--out", self.folder / "zeroed")
        self.assertIn(line, answer.stdout)
        self.assertRegex(answer.stdout, r"recorded +FAILED")
        for arguments in (("--csv", log, self.folder / "zeroed_csv"), ("--mcap", log, self.folder / "zeroed.mcap")):
            answer = run("chase-log", "export", *arguments)
            self.assertEqual((answer.returncode, answer.stderr), (0, f"{log}: {line}"))
        for form in ("--csv", "--mcap"):
            answer = run("chase-log", "export", form, "--channel", "IMU", log, self.folder / "none_of_it")
            self.assert_refused(answer, 1, line.strip())

    def test_what_others_heard_and_the_log_lacks_is_said(self):
        log = self.without("no_imu.lcm", lambda channel, k: channel in ("IMU", "POSE"))
        text = self.good("info", log)
        for channel in ("IMU", "POSE"):
            self.assertIn(f"{channel}: others heard", text)

    def test_what_is_lost_at_a_channels_end_counts(self):
        kept = self.count("POSE") // 2
        log = self.without("tail.lcm", lambda channel, k: channel == "POSE" and k >= kept)
        pose = next(line for line in self.good("info", log).splitlines() if line.startswith("POSE")).split()
        self.assertAlmostEqual(int(pose[-2]), self.count("POSE") - kept, delta=2)  # the last is heard by nobody any more
        self.assertAlmostEqual(float(pose[-1]), (self.count("POSE") - kept) / 200, delta=0.02)
        self.assertRegex(run("chase-report", log, "--out", self.folder / "tail").stdout, r"recorded +FAILED")

    def test_cut_and_damaged_logs_are_read_as_far_as_they_go(self):
        data = self.log.read_bytes()
        cut = self.folder / "cut.lcm"
        cut.write_bytes(data[:-100])
        self.assertIn("cut off", self.good("info", cut))
        sync = lcmlog.SYNC.to_bytes(4, "big")
        at = data.index(sync + (1000).to_bytes(8, "big"))  # the 1000th event
        for name, wrong in (("sync", b"\0" * 4), ("length", data[at:at + 24] + b"\x7f\xff\0\0")):
            damaged = self.folder / f"{name}.lcm"
            damaged.write_bytes(data[:at] + wrong + data[at + len(wrong):])
            text = self.good("info", damaged)
            self.assertIn("the log is damaged, maybe the message before them, too", text)
            count = sum(int(line.split()[2]) for line in text.splitlines() if " Hz " in line)
            self.assertEqual(count, len(self.events) - 1, name)

    def test_diff_tells_lost_from_different(self):
        lost = self.without("diff.lcm", lambda channel, k: channel == "IMU" and k == 10)
        answer = run("chase-log", "diff", self.log, lost)
        self.assertEqual(answer.returncode, 1, answer.stderr)
        n = self.count("IMU")
        self.assertEqual(answer.stdout, f"IMU: {n} messages against {n - 1}; 1 of A are not in B\n")

    def test_diff_lists_channels_of_one_log_alone(self):
        none = self.without("none.lcm", lambda channel, k: channel in ("IMU", "POSE"))
        self.assertEqual(self.good("diff", self.log, none), "only in A: IMU, POSE\nno difference\n")
        self.assertEqual(self.good("diff", none, self.log, "--ignore", "IMU"), "only in B: POSE\nno difference\n")
        imu = self.without("imu_alone.lcm", lambda channel, k: channel != "IMU")
        self.assert_refused(run("chase-log", "diff", none, imu), 2, "no channel in common")

    def test_diff_refuses_to_ignore_what_neither_log_holds(self):
        for pattern in ("NO_SUCH.seq", "NO_SUCH"):
            self.assert_refused(run("chase-log", "diff", self.log, self.log, "--ignore", pattern), 2, pattern, "info")
        self.good("diff", self.log, self.log, "--ignore", "*_STATUS.*", "--ignore", "POSE", "--ignore", "*.seq")
        for pattern in ("POSE.nope", "P?SE.nope", "POSE.inputs"):
            answer = run("chase-log", "diff", self.log, self.log, "--ignore", pattern)
            self.assert_refused(answer, 2, f"--ignore {pattern}: there is no such field; POSE has utime, seq, ", " inputs.seq, ", "count")
        self.assert_refused(run("chase-log", "diff", self.log, self.log, "--ignore", "*.nope"), 2, "; each channel has utime, seq, ", "count")
        self.good("diff", self.log, self.log, *(f"--ignore=POSE.{field}" for field in ("inputs.*", "count", "event_time", "bytes")),
                  "--ignore", "OBSTACLES.obstacles.center.coefficients")

    def test_diff_ignores_channels_by_a_pattern(self):
        lost = self.without("fewer.lcm", lambda channel, k: channel.endswith("_STATUS") and k == 0)
        self.assertEqual(run("chase-log", "diff", self.log, lost).returncode, 1)
        self.assertEqual(self.good("diff", self.log, lost, "--ignore", "*_STATUS"), "no difference\n")

    def test_diff_of_nothing_is_no_answer(self):
        imu = self.without("only_imu.lcm", lambda channel, k: channel != "IMU")
        for pattern in ("*", "*.*", "IMU", "IMU.*"):
            self.assert_refused(run("chase-log", "diff", self.log, imu, "--ignore", pattern), 2, "nothing to compare")
        self.good("diff", self.log, imu, "--ignore", "IMU.seq")

    def test_verify_tells_refuted_from_unknown(self):
        lacking = {name: self.without(f"no_{name}.lcm", lambda channel, k, name=name: channel == name) for name in ("OBSTACLES", "PREDICTION")}
        some = self.without("some_lists.lcm", lambda channel, k: channel == "OBSTACLES" and k % 2)
        for code, arguments in ((0, (self.log,)), (1, (self.log, "--radius", "5")), (2, (lacking["OBSTACLES"],)),
                                (2, (lacking["PREDICTION"],)), (2, (some,)), (1, (some, "--radius", "5"))):
            with self.subTest(arguments=arguments):
                answer = run("chase-log", "verify", *arguments)
                self.assertEqual(answer.returncode, code, answer.stdout + answer.stderr)

    def test_verify_and_diff_tell_of_a_cut_log(self):
        cut = self.folder / "verify_cut.lcm"
        cut.write_bytes(pathlib.Path(self.log).read_bytes()[:-1000])
        answer = run("chase-log", "verify", cut)
        self.assertEqual(answer.returncode, 2, answer.stdout)
        self.assertIn("the log was cut off; what is lost is not verified", answer.stdout)
        self.assertEqual(run("chase-log", "verify", cut, "--radius", "5").returncode, 1)
        self.assertIn(f"{cut}: the last ", run("chase-log", "diff", self.log, cut).stderr)

    def test_verify_counts_proofs_about_lists_that_are_missing(self):
        blind = self.without("no_lists.lcm", lambda channel, k: channel == "OBSTACLES")
        proofs, left = re.search(r"(\d+) proofs, (\d+) of them not verified: ", run("chase-log", "verify", blind).stdout).groups()
        self.assertEqual(proofs, left)
        self.assertIn(" proofs, 0 of them not verified;", self.good("verify", self.log))

    def test_verify_names_plans_that_it_cannot_verify(self):
        figures = r"(\d+) of them certified: (\d+) proven, \d+ refuted"
        certified, proven = map(int, re.search(figures, self.good("verify", self.log)).groups())
        self.assertEqual(proven, certified)
        blind = self.without("unforeseen.lcm", lambda channel, k: channel == "PREDICTION")
        text = run("chase-log", "verify", blind).stdout
        certified, proven = map(int, re.search(figures, text).groups())
        named = re.findall(r"(?m)^plan \d+: (\d+) proofs not verified$", text)
        self.assertGreater(len(named), 0)
        self.assertEqual(proven, certified - len(named), text)
        self.assertIn(f" proofs, {sum(map(int, named))} of them not verified", text)

    def test_verify_without_a_certificate_tells_no_radius(self):
        log, events = self.folder / "uncertified.lcm", []
        for utime, channel, data in self.events:
            if channel == "PLAN":
                plan = chase.plan_t.decode(data)
                plan.certified_clearance = -1.0
                data = plan.encode()
            events.append((utime, channel, data))
        lcmlog.write(log, events)
        text = run("chase-log", "verify", log).stdout
        self.assertIn(" plans, 0 of them certified: 0 proven", text)
        self.assertNotIn("radius", text)
        self.assertIn("; radius 0.", self.good("verify", self.log))

    def test_verify_refuses_what_is_no_bound(self):
        for option, values in (("--radius", ("nan", "inf", "-1", "0", "x")), ("--sigmas", ("nan", "inf", "-1", "x"))):
            for value in values:
                with self.subTest(option=option, value=value):
                    answer = run("chase-log", "verify", self.log, option, value)
                    self.assert_refused(answer, 2, option, f" {value} is no ")

    def test_no_answer_is_not_a_difference(self):
        for program in (("diff", self.log, "no.lcm"), ("diff", self.log), ("verify", "no.lcm"), ("verify",)):
            self.assert_refused(run("chase-log", *program), 2)

    def test_diff_of_a_replay_pairs_by_time(self):
        half = self.folder / "half.lcm"
        lcmlog.write(half, [e for e in self.events if e[0] >= 5_000_000])
        again = self.folder / "again.lcm"
        self.assertEqual(run("chase-planning", "--replay", half, "--out", again).returncode, 0)
        lines = run("chase-log", "diff", half, again).stdout.splitlines()
        plan = next(line for line in lines if line.startswith("PLAN: "))
        ours = sum(channel == "PLAN" for _, channel, _ in lcmlog.read(again))
        unpaired = re.search(r"(\d+) of B are not in A", plan)
        self.assertLess(int(unpaired.group(1)) if unpaired else 0, ours / 2, plan)

    def test_a_damaged_log_is_replayed_behind_the_damage(self):
        def plans(log):
            answer = run("chase-planning", "--replay", log, "--out", self.folder / "replayed.lcm")
            self.assertEqual(answer.returncode, 0, answer.stderr)
            return self.counts(self.folder / "replayed.lcm")["PLAN"], answer.stderr
        data = self.log.read_bytes()
        whole, words = plans(self.log)
        self.assertNotIn("damaged", words)
        sync = lcmlog.SYNC.to_bytes(4, "big")
        at = data.index(sync + (len(self.events) // 2).to_bytes(8, "big"))
        damaged = self.folder / "replay_damaged.lcm"
        damaged.write_bytes(data[:at + 24] + b"\x00\x7f\0\0" + data[at + 28:])
        count, words = plans(damaged)
        self.assertGreater(count, whole - 2)
        self.assertIn(f"at {at} are no whole event: the log is damaged", words)
        damaged.write_bytes(data[:-100])
        self.assertIn("cut off", plans(damaged)[1])

    def test_lockstep_and_replay_tell_the_configuration(self):
        def cksum(*command):
            return subprocess.run(["cksum"], input=run(*command).stdout, check=True, capture_output=True, text=True).stdout.split()[0]
        out = self.folder / "configured.lcm"
        self.assertEqual(run("chase-prediction", "--replay", self.log, "--out", out).returncode, 0)
        replayed = cksum("chase-prediction", "--dump-config")
        self.assertIn(f"configuration (cksum of --dump-config)  prediction {replayed}\n", self.good("info", out))
        for process in ("control", "planning", "simulator"):
            flown = cksum("chase-flight", ROOT / "deploy/scenarios/gym.yaml", "--print-config", process)
            self.assertRegex(self.good("info", self.log), rf"configuration .*\b{process} {flown}\b")

    def test_a_replay_says_which_channels_it_lacks(self):
        out = self.folder / "of_imu.lcm"
        imu = self.without("imu.lcm", lambda channel, k: channel != "IMU")
        answer = run("chase-odometry", "--replay", imu, "--out", out)
        self.assertEqual(answer.stderr, "chase-odometry: the log holds nothing of LIDAR_SCAN\n")
        self.assert_refused(run("chase-lidar", "--replay", self.log, "--out", self.folder / "none.lcm"), 1, "hears no channel")

    def test_packets_of_the_bus_stay_out(self):
        log = self.folder / "loopback.lcm"
        lcmlog.write(log, [(self.events[0][0], "LOOPBACK_4711", b""), *self.events])
        self.assertNotIn("LOOPBACK", self.good("info", log))

    def test_reports_say_what_is_missing(self):
        out = self.folder / "report"
        log = self.without("report.lcm", lambda channel, k: channel in ("IMU", "POSE") and k % 3)
        log.write_bytes(log.read_bytes()[:-50])
        answer = run("chase-report", log, "--out", out)
        self.assertEqual(answer.returncode, 2, answer.stderr)
        self.assertIn("cut off", answer.stderr)
        self.assertIn("IMU: ", answer.stdout)
        text = (out / "metrics.json").read_text()
        self.assertNotRegex(text, r"\.\d{12}", "six significant digits")
        metrics = json.loads(text)
        self.assertFalse(metrics["passed"])
        self.assertFalse(metrics["criteria"]["recorded"])
        self.assertIn("the log is cut off", metrics["shortfall"])
        self.assertIn(metrics["shortfall"], answer.stderr)
        self.assertIn('"shortfall":"the log is cut off', (out / "report.html").read_text())
        self.assertGreater(metrics["lost_messages"]["IMU"], 0.6 * self.count("IMU"))
        self.assertEqual(metrics["lost_messages"]["TRUTH"], 0)
        self.assertIn("are missing", (out / "report.html").read_text())
        self.assertRegex(metrics["software"]["versions"]["planning"], r"\(commit \w+")

    def test_two_flights_are_compared(self):
        out = self.folder / "compared"
        same = run("chase-report", self.log, self.log, "--out", out)
        self.assertEqual(same.returncode, 2, "both end after a second of a minute")
        self.assertIn("\nB is worse in nothing\n", same.stdout)
        text = (out / "comparison.txt").read_text()
        self.assertIn(text, same.stdout)
        for side in "AB":
            self.assertRegex(text, rf"(?m)^{side}: {self.log}\n  gym, seed \d+, 1\.0 s flown\n  .*commit \w+"
                             r".*\n  configurations: .*\bcontrol \d+.*\n  the log ends at 1\.0 s of ")
        self.assertRegex(text, r"safe_ratio +100\.00 % +100\.00 %\n")
        self.assertIn('"compared":[{"key":"safe_ratio"', (out / "report.html").read_text())
        own = run("chase-report", self.log, self.log, "--out", self.folder)
        self.assert_refused(own, 1, "own report", "another folder")
        bare = self.without("bare_b.lcm", lambda channel, k: channel in ("TRUTH", "SCENARIO"))
        for mixed in (run("chase-report", self.log, bare), run("chase-report", bare, self.log)):  # by what both vehicles said
            self.assert_refused(mixed, 2, self.log, "the log ends at 1.0 s of 60.0 s")
            self.assertIn("\n  the log ends at 1.0 s of 60.0 s; the figures are of that part\n", mixed.stdout)
            self.assertRegex(mixed.stdout, r"pose_sigma_max_m +[\d.]+ m +[\d.]+ m\n")
        blind = self.without("blind.lcm", lambda channel, k: channel == "POSE")
        worse = run("chase-report", self.log, blind).stdout
        self.assertRegex(worse, r"odometry_ate_m +[\d.]+ m +not known\n")
        self.assertRegex(worse, r"\nB is worse in .+; not known of B: [1-9]\d*\n")
        better = run("chase-report", blind, self.log).stdout
        self.assertRegex(better, r"odometry_ate_m +not known +[\d.]+ m\n")

    def test_a_log_that_begins_late_is_not_the_whole_flight(self):
        late = self.folder / "late.lcm"
        self.good("cut", self.log, late, "--from", "8.5")
        answer = run("chase-report", late, "--out", self.folder / "late")
        self.assert_refused(answer, 2, "begins at 0.5 s and ends at 1.0 s of 60.0 s")
        self.assertRegex(answer.stdout, r"complete +FAILED")

    def test_a_log_too_short_for_the_mission_is_not_judged(self):
        short, out = self.folder / "climb.lcm", self.folder / "climb"
        self.good("cut", self.log, short, "--to", "3")
        answer = run("chase-report", short, "--out", out)
        self.assertEqual(answer.returncode, 2, answer.stderr)
        self.assertRegex(answer.stdout, r"safe_ratio +not known\n")
        self.assertRegex(answer.stdout, r"recorded +passed\n")
        self.assertIn('"judged":false', (out / "report.html").read_text())

    def test_truth_without_its_scenario_is_told(self):
        out = self.folder / "no_scenario"
        for name in ("TRUTH", "SCENARIO"):
            log = self.without("half_truth.lcm", lambda channel, k, name=name: channel == name)
            answer = run("chase-report", log, "--out", out)
            self.assertEqual(answer.returncode, 0, answer.stderr)
            self.assertIn(f"half_truth.lcm holds no {name}: reported is what the vehicle said of itself\n", answer.stdout)
            metrics = json.loads((out / "metrics.json").read_text())
            self.assertIs(metrics["truth"], False)
            self.assertIsNone(metrics["shortfall"], "there is no FLIGHT_STATE")
            self.assertIn("\nwhether this is the whole flight is not known\n", answer.stdout)
            self.assertIn("\n  whether this is the whole flight is not known\n", run("chase-report", log, self.log).stdout)

    def with_states(self, name, *states):
        """A log without truth in which mission says these, evenly spread."""
        events = [e for e in self.events if e[1] not in ("TRUTH", "SCENARIO")]
        for k, state in enumerate(states):
            message = chase.flight_state_t()
            message.utime = events[len(events) * k // len(states)][0]
            message.state = state
            events.append((message.utime, "FLIGHT_STATE", message.encode()))
        lcmlog.write(self.folder / name, sorted(events, key=lambda event: event[0]))
        return self.folder / name

    def test_a_flight_without_truth_ends_and_begins_on_the_ground(self):
        state = chase.flight_state_t
        for words, states in (([], (state.IDLE, state.CHASE, state.DONE)),
                              (["the log ends in CHASE at "], (state.READY, state.CHASE)),
                              (["the log begins in HOLD and ends in LAND at "], (state.HOLD, state.LAND)),
                              (["the log begins in CHASE;"], (state.CHASE, state.DONE))):
            answer = run("chase-report", self.with_states("states.lcm", *states), "--out", self.folder / "states")
            with self.subTest(words=words):
                if words:
                    self.assert_refused(answer, 2, *words)
                else:
                    self.assertEqual(answer.returncode, 0, answer.stderr)
                self.assertNotIn("not known", answer.stdout)

    def test_report_has_a_time_line_and_what_was_certified(self):
        out = self.folder / "lines"
        run("chase-report", self.log, "--out", out)
        page = (out / "report.html").read_text()
        self.assertRegex(page, r'"lane":"verdict","label":"\w+"')
        self.assertRegex(page, r'"certified":\{"t":\[')

    def test_a_log_without_truth_is_reported_by_what_the_vehicle_said(self):
        out = self.folder / "vehicle"
        log = self.without("vehicle.lcm", lambda channel, k: channel in ("TRUTH", "SCENARIO") or
                           channel == "IMU" and 100 <= k < 150)
        answer = run("chase-report", log, "--out", out)
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertIn("no TRUTH", answer.stdout)
        metrics = json.loads((out / "metrics.json").read_text())
        self.assertEqual(metrics["replans"], self.count("PLAN"))
        self.assertAlmostEqual(sum(metrics["pose_health_s"].values()), metrics["flown_s"], delta=1.0)
        self.assertGreater(metrics["latency_ms"]["TARGET"]["p50"], 0.0)
        self.assertIn("certified_clearance_m", metrics)
        self.assertAlmostEqual(metrics["longest_gap_s"]["IMU"], 0.255)  # 51 periods
        self.assertAlmostEqual(metrics["gap_begins_s"]["IMU"], 0.495, delta=0.011)
        self.assertRegex((out / "report.html").read_text(), r"IMU: longest gap 0\.2[56] s, from 0\.5 s of the log on")
        self.assertRegex(answer.stdout, "IMU: longest gap")
        self.assertIn('"lane":"pose"', (out / "report.html").read_text())
        log.write_bytes(log.read_bytes()[:-50])
        self.assert_refused(run("chase-report", log, "--out", out), 2, "cut off")
        bare = self.without("bare.lcm", lambda channel, k: channel != "IMU")
        self.assert_refused(run("chase-report", bare, "--out", out), 1, "no flight to report")

    def counts(self, log):
        found = {}
        for _, channel, _ in lcmlog.read(log):
            found[channel] = found.get(channel, 0) + 1
        return found

    def test_cut_copies_a_stretch_of_time(self):
        out = self.folder / "stretch.lcm"
        self.good("cut", self.log, out, "--from", "2", "--to", "3.5")
        first = self.events[0][0]
        self.assertEqual(list(lcmlog.read(out)),
                         [e for e in self.events if 2_000_000 <= e[0] - first < 3_500_000])

    def test_filter_copies_channels(self):
        out = self.folder / "some.lcm"
        self.good("filter", self.log, out, "--keep", "P*,IMU", "--drop", "*_STATUS")
        self.assertEqual(set(self.counts(out)), {"POSE", "PLAN", "PREDICTION", "IMU"})
        self.assertEqual(self.counts(out)["IMU"], self.count("IMU"))

    def test_merge_puts_together_what_was_parted(self):
        parts = self.folder / "imu.lcm", self.folder / "rest.lcm"
        self.good("filter", self.log, parts[0], "--keep", "IMU,POSE")
        self.good("filter", self.log, parts[1], "--drop", "IMU")
        out = self.folder / "merged.lcm"
        self.assertIn(f"{self.count('POSE')} messages were in several logs",
                      self.good("merge", *parts, out))
        self.assertEqual(run("chase-log", "diff", self.log, out).stdout, "no difference\n")

    def test_repair_keeps_all_that_can_be_read(self):
        at = next(k for k, e in enumerate(self.events) if e[1] == "POSE" and k > 500)
        utime, channel, data = self.events[at]
        events = list(self.events)
        events[at] = utime, channel, data[:100]
        damaged, out = self.folder / "damaged.lcm", self.folder / "repaired.lcm"
        lcmlog.write(damaged, events)
        raw = damaged.read_bytes()
        middle = raw.index(lcmlog.SYNC.to_bytes(4, "big"), len(raw) // 2)
        damaged.write_bytes(raw[:middle] + b"xxxx" + raw[middle + 4:-10])
        answer = run("chase-log", "repair", damaged, out)
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertIn("POSE: 1 messages do not decode", answer.stdout)
        self.assertEqual(answer.stderr.count("log is damaged, maybe the message before them, too"), 1, answer.stderr)
        self.assertEqual(answer.stderr.count("cut off"), 1, answer.stderr)
        inside = self.folder / "inside.lcm"
        inside.write_bytes(raw[:middle] + b"xxxx" + raw[middle + 4:])
        self.assertEqual(run("chase-log", "repair", inside, self.folder / "again.lcm").stderr.count("log is damaged"), 1)
        self.assertEqual(sum(self.counts(out).values()), len(self.events) - 3)
        self.assertNotIn("damaged", self.good("info", out))

    def test_selections_of_nothing_are_refused(self):
        out = self.folder / "nothing.lcm"
        for words, arguments in ((("--from",), ("cut",)), (("--keep",), ("filter",)),
                                 (("--from 5", "later"), ("cut", "--from", "5", "--to", "5")),
                                 (("lasts", "--from"), ("cut", "--from", "1000")),
                                 (("NO_SUCH", "info"), ("filter", "--keep", "NO_SUCH")),
                                 (("--long", "--csv"), ("export", "--tum", "--long")),
                                 (("--rig", "--mcap"), ("export", "--csv", "--rig", self.log))):
            with self.subTest(arguments=arguments):
                answer = run("chase-log", *arguments, self.log, out)
                self.assert_refused(answer, 2, *words)
                self.assertFalse(out.exists())

    def test_csv_onto_a_file_is_refused(self):
        self.assert_refused(run("chase-log", "export", "--csv", self.log, self.log), 1, "is read")
        taken = self.folder / "taken.csv"
        taken.write_text("")
        self.assert_refused(run("chase-log", "export", "--csv", self.log, taken), 1, "taken.csv: is no folder")

    def test_long_csv_has_a_row_for_every_element(self):
        out = self.folder / "csv"
        self.good("export", "--csv", "--long", "--channel", "OBSTACLES", self.log, out)
        lines = (out / "OBSTACLES.csv").read_text().splitlines()
        self.assertEqual(lines[0], "event_utime,seq,field,index,value")
        rows = list(csv.DictReader(lines))
        ids = [row for row in rows if row["field"] == "obstacles.id"]
        counts = [float(row["value"]) for row in rows if row["field"] == "n_obstacles"]
        self.assertEqual(len(counts), self.count("OBSTACLES"))
        self.assertEqual(len(ids), sum(counts))
        self.assertEqual(int(ids[-1]["index"]), counts[-1] - 1)

    def mcap(self, *options, log=None):
        out = self.folder / "flight.mcap"
        self.good("export", "--mcap", *options, log or self.log, out)
        modules = ROOT / "logs/node_modules"
        if not (modules / "@mcap/core").is_dir():
            self.skipTest("skipped: npm ci --prefix logs brings the readers")
        answer = subprocess.run(["node", ROOT / "test/unit/mcap_check.cjs", modules, out],
                                capture_output=True, text=True, timeout=LIMIT, check=False)
        self.assertEqual(answer.returncode, 0, answer.stderr)
        return json.loads(answer.stdout)

    def test_mcap_is_read_by_the_loader_of_foxglove(self):
        every = self.folder / "every.lcm"
        events, lacking = every_channel.added(chase, self.events)
        lcmlog.write(every, events)
        self.assertIn("FLIGHT_STATE", lacking)
        topics = self.mcap(log=every)
        counts = self.counts(every)
        passed = [channel for channel, count in counts.items() if topics.get(channel, {}).get("count") == count]
        self.assertEqual(set(passed), set(counts), "a schema does not resolve, or a message does not decode by it")
        print(f"MCAP: {len(passed)} of {len(counts)} channels and {len(topics) - len(passed)} topics beside them pass "
              "the loader's check")
        for topic, schema in (("LIDAR_SCAN", "PointCloud"), ("CAMERA_IMAGE", "RawImage"),
                              ("CAMERA_IMAGE/calibration", "CameraCalibration"),
                              ("POSE/pose", "PoseInFrame"), ("/tf", "FrameTransforms"),
                              ("OBSTACLES/scene", "SceneUpdate"), ("OBSTACLES/grown", "SceneUpdate"), ("PLAN/scene", "SceneUpdate"),
                              ("TARGET/scene", "SceneUpdate"), ("PLANNING_STATUS/log", "Log")):
            self.assertEqual(topics[topic]["schema"], f"foxglove.{schema}")
        pose = topics["POSE"]["first"]
        self.assertEqual((pose["seq"], len(pose["covariance"])), (0, 81))
        image = topics["CAMERA_IMAGE"]["first"]
        self.assertEqual((image["width"], image["data"]), (376, 376 * 240 * 3))

    def test_mcap_of_one_channel_with_jpeg(self):
        topics = self.mcap("--channel", "CAMERA_IMAGE", "--jpeg")
        self.assertEqual(set(topics), {"CAMERA_IMAGE", "CAMERA_IMAGE/calibration"})
        self.assertEqual(topics["CAMERA_IMAGE"]["schema"], "foxglove.CompressedImage")
        self.assertLess(topics["CAMERA_IMAGE"]["first"]["data"], 376 * 240 / 2)

    def rig(self, name="rig.yaml", more=""):
        file = self.folder / name
        file.write_text(f"rig: {{lens: fisheye, lens_coefficients: [0.1, 0.2, 0.3, 0.4, 0], focal_px: 250}}\n{more}")
        return file

    def test_mcap_takes_the_rig_that_flew(self):
        flight = self.folder / "with_rig"
        flight.mkdir()
        lcmlog.write(flight / "flight.lcm", [e for e in self.events if e[1] == "CAMERA_IMAGE"])
        out = self.folder / "rig.mcap"
        self.assertIn(" messages, with the default rig\n", self.good("export", "--mcap", flight, out))
        file = self.rig("with_rig/perception.yaml", "target_shape: {radius: 0.2}\n")
        self.assertIn(f" messages, with the rig of {file}\n", self.good("export", "--mcap", flight, out))
        flown = out.read_bytes()
        self.assertIn(f"with the rig of {file}\n", self.good("export", "--mcap", "--rig", file, self.log, self.folder / "of.mcap"))
        self.good("export", "--mcap", "--rig", self.rig(), flight, out)
        self.assertEqual(out.read_bytes(), flown)
        file.write_text("target_shape: {radius: 0.2}\n")
        self.assert_refused(run("chase-log", "export", "--mcap", "--rig", file, flight, out), 1, "perception.yaml", "no key rig")
        self.rig("with_rig/perception.yaml").write_text("rig: {lens: round}\n")
        self.assert_refused(run("chase-log", "export", "--mcap", flight, out), 1, "perception.yaml", "lens")

    def test_mcap_tells_the_lens_of_the_rig(self):
        rig = self.rig()
        lens = self.mcap("--channel", "CAMERA_IMAGE", "--jpeg", "--rig", rig)["CAMERA_IMAGE/calibration"]["first"]
        self.assertEqual((lens["distortion_model"], lens["D"], lens["K"][0]), ("kannala_brandt", [0.1, 0.2, 0.3, 0.4], 250))
        pinhole = self.mcap("--channel", "CAMERA_IMAGE", "--jpeg")["CAMERA_IMAGE/calibration"]["first"]
        self.assertEqual((pinhole["distortion_model"], pinhole["D"]), ("plumb_bob", [0] * 5))

    def test_a_flights_folder_stands_for_its_log(self):
        for command in ("info", "verify"):
            self.assertEqual(self.good(command, self.folder), self.good(command, self.log))
        self.good("cut", self.folder, self.folder / "of_folder.lcm", "--to", "0.5")
        self.assertEqual(self.good("diff", self.folder, self.log), "no difference\n")
        self.good("merge", self.folder, self.log, self.folder / "of_folders.lcm")
        self.assertIn("folders of flights", self.good("merge", "--help"))
        self.assertEqual(run("chase-report", self.folder).returncode, 2)  # a second of it was flown
        self.assertTrue((self.folder / "report.html").exists())
        self.assert_refused(run("chase-log", "cut", self.folder, self.log, "--to", "1"), 1, "is read")
        empty = self.folder / "empty"
        empty.mkdir()
        for program in (["chase-log", "info"], ["chase-report"], ["chase-viewer", "--port", "0", "--play"]):
            self.assert_refused(run(*program, empty), 1, "empty/flight.lcm", "no such file")
        self.assert_refused(run("chase-log", "info", "/dev/null"), 1, "no regular file")

    def test_output_that_cannot_be_written(self):
        out = self.folder / "full.lcm"
        kept = self.folder / "half.lcm"
        self.good("cut", self.log, kept, "--to", "0.5")
        for code, *command in ((1, "chase-log", "info", self.log), (2, "chase-log", "diff", self.log, self.log),
                               (2, "chase-log", "verify", self.log), (1, "chase-log", "identify", self.log),
                               (1, "chase-log", "export", "--tum", self.log, self.folder / "full.tum"),
                               (1, "chase-log", "cut", self.log, out, "--to", "0.5"), (1, "chase-log", "repair", self.log, out),
                               (1, "chase-log", "filter", self.log, out, "--keep", "IMU"), (1, "chase-log", "migrate", self.log, out),
                               (1, "chase-log", "merge", self.log, kept, out),
                               (2, "chase-report", self.log, "--out", self.folder / "full")):  # 2: a second of it was flown
            with self.subTest(command=command), open("/dev/full", "w", encoding="utf-8") as full:
                answer = subprocess.run([BIN / command[0], *command[1:]], stdout=full, stderr=subprocess.PIPE, text=True,
                                        timeout=LIMIT, check=False)
                self.assertEqual(answer.returncode, code, answer.stderr)
                self.assertIn(f"{command[0]}: standard output could not be written; is the disk full?\n", answer.stderr)

    def test_refusals_point_to_the_commands_own_help(self):
        self.assert_refused(run("chase-log", "cut"), 1, "see chase-log cut --help")
        self.assert_refused(run("chase-log", "no_such"), 1, "see chase-log --help")

    def test_identify_takes_a_flights_folder(self):
        text = self.good("identify", self.folder)
        self.assertEqual(text, self.good("identify", self.log))
        self.assertRegex(text, r"drag, horizontal .* not observable, .*level flight to and fro")

    def test_identify_writes_what_a_climb_shows(self):
        out, present = self.folder / "climb.yaml", self.folder / "control.yaml"
        self.good("identify", self.log, "--out", out)
        self.assertNotIn("drag:", out.read_text(), "control's own would be lost")
        present.write_text("drag: [0.5, 0.4, 0.3]\n")
        self.good("identify", self.log, "--out", out, "--config", present)
        self.assertRegex(out.read_text(), r"drag: \[0\.5, 0\.4, 0\.1\d*\]")
        answer = run("chase-control", "--config", out, "--dump-config")
        self.assertEqual(answer.returncode, 0, answer.stderr)

    def test_identify_updates_what_the_services_read(self):
        etc = self.folder / "etc"
        etc.mkdir()
        (etc / "control.yaml").write_text("# Ours.\n#drag: [0.25, 0.25, 0.25]  # 1/s\nposition_gain: [5, 5, 6]\n")
        text = self.good("identify", self.log, "--update", etc)
        self.assertIn("control.yaml: drag: [", text)
        self.assertIn("fcu.yaml: stays", text)
        self.assertRegex((etc / "control.yaml").read_text(),
                         r"^# Ours\.\n#drag: .*\ndrag: \[.*\]  # by chase-log identify: .*\nposition_gain: \[5, 5, 6\]\n")
        answer = run("chase-control", "--config", etc / "control.yaml", "--dump-config")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertFalse((etc / "fcu.yaml").exists())

        fcu = etc / "fcu.yaml"
        fcu.write_text("link: udp  # a simulator\n")
        status = chase.status_t()
        status.utime, status.name = self.events[-1][0], "fcu"
        status.version = f"0.1.0, host here, configuration {self.cksum('chase-fcu', '--config', fcu)}"
        flown = self.folder / "by_fcu.lcm"
        lcmlog.write(flown, [*self.events, (status.utime, "FCU_STATUS", status.encode())])
        self.assertIn("fcu.yaml: hover_thrust: 0.5", self.good("identify", flown, "--update", etc))
        self.assertRegex(fcu.read_text(), r"^link: udp  # a simulator\nhover_thrust: 0\.5\d*  # by chase-log identify: ")
        self.assert_refused(run("chase-log", "identify", flown, "--update", etc), 1, "put back the file that flew")

        short = self.folder / "too_short.lcm"
        self.good("cut", self.log, short, "--to", "3")
        before = (etc / "control.yaml").read_text()
        self.assert_refused(run("chase-log", "identify", short, "--update", etc), 1, "less than 5 s")
        self.assert_refused(run("chase-log", "identify", self.log, "--update", self.folder / "no"), 1, "no folder")
        self.assertEqual((etc / "control.yaml").read_text(), before)

    def test_identify_says_what_it_lacks(self):
        out = self.folder / "none.yaml"
        short = self.folder / "short.lcm"
        self.good("cut", self.log, short, "--to", "3")
        no_imu = self.without("identify.lcm", lambda channel, k: channel == "IMU")
        for code, words, arguments in ((1, "less than 5 s", (short, "--out", out)),
                                       (1, "holds no IMU", (no_imu, "--out", out)),
                                       (1, "control.yaml", (self.log, "--out", out, "--config",
                                                            self.folder / "no/control.yaml")),
                                       (2, "--out", (self.log, "--config", out)),
                                       (1, "is read", (self.log, "--out", self.log))):
            with self.subTest(words=words):
                self.assert_refused(run("chase-log", "identify", *arguments), code, words)
                self.assertFalse(out.exists())

    def test_every_command_has_help(self):
        for command in ("info", "import", "export", "diff", "cut", "filter", "merge", "repair",
                        "migrate", "verify", "identify"):
            self.assertIn("Usage:", self.good(command, "--help"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
