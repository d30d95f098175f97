"""Bad use of every program: one line on stderr that says what, where and how to mend it; exit 1, or 2 where
1 is an answer.

bad_use.py BIN_DIR SERVICE..."""

import os
import pathlib
import re
import socket
import subprocess
import sys
import tempfile
import unittest

import tree

TESTS = pathlib.Path(__file__).resolve().parents[1]
BIN = pathlib.Path(sys.argv[1])
SERVICES = sys.argv[2:]
LIVE = ("lidar", "camera", "fcu", "link")  # these look for their device or the live bus before anything else
TOOLS = [["chase-flight"], ["chase-plan"], ["chase-predict"], ["chase-report"],
         ["chase-log", "info"], ["chase-compare"], ["chase-scenario"], ["chase-world"],
         ["chase-campaign", "--out", "no/such", "--scenarios"]]
TOOL_SERVICES = {"lidar", "camera", "odometry", "mapping", "perception", "prediction", "planning",
                 "control", "mission", "simulator"}
CAMPAIGNS = ["perception_campaign", "perception_photos", "../test/mapping_campaign", "../test/mapping_walkers",
             "../test/odometry_trial"]  # each flies one service
# Scripts that nobody calls by hand: systemd, Slurm, other scripts or CTest do.
INNER = ("*_test.py", "deploy/package/chase-*", "deploy/package/post*", "deploy/package/pre*", "deploy/slurm/flight.sbatch",
         "deploy/systemd/back-off", "test/flight/stand_in_*.py", "test/link/two_hosts.py", "test/package/clean_root_check",
         "test/unittest_run.py")
SIZE_TEST = pathlib.Path("test/unit/mcap_size_test.py")  # by hand, too
SCRIPTS = [path for path in tree.files() if path.parts[0] in (".ci", "deploy", "test") and tree.text(path).startswith("#!") and
           (path == SIZE_TEST or not any(path.match(inner) for inner in INNER))]
LIMIT = 20  # s


def run(program, *arguments):
    """`program` is a name, or a list of a name and a subcommand."""
    name, *rest = [program] if isinstance(program, str) else program
    return subprocess.run([BIN / name, *rest, *map(str, arguments)], capture_output=True, text=True,
                          timeout=LIMIT, check=False)


def programs():
    built = [path.name for pattern in ("chase-*", "bench_*") for path in sorted(BIN.glob(pattern))]
    return built + [name for name in CAMPAIGNS if (BIN / name).exists()]


def first_scalar(dump):
    """Path of keys to the first scalar field of a dumped config."""
    path = []
    for line in dump.splitlines():
        match = re.match(r"^( *)(\w+):(.*)$", line)
        if not match:
            continue
        depth = len(match.group(1)) // 2
        path = path[:depth] + [match.group(2)]
        value = re.sub(r"\s+#.*$", "", match.group(3)).strip()
        if value and not value.startswith("["):
            return path
    return []


def nested(path, value):
    lines = ["  " * i + f"{key}:" for i, key in enumerate(path)]
    return "\n".join(lines) + f" {value}\n"


class BadUse(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def file(self, text):
        path = pathlib.Path(self.folder.name) / "config.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    def assert_refused(self, answer, *words, code=1):
        line = answer.stderr
        self.assertEqual(answer.returncode, code, line)
        self.assertEqual(line.count("\n"), 1, f"not one line: {line!r}")
        self.assertEqual(answer.stdout, "", "an error belongs on stderr")
        for word in words:
            self.assertIn(str(word), line)

    def for_each(self, programs, check):
        for program in programs:
            with self.subTest(program=program):
                check(program)

    def services(self):
        return [f"chase-{name}" for name in SERVICES]

    def replayable(self):
        return [f"chase-{name}" for name in SERVICES if name not in LIVE]

    def test_good_use(self):
        def check(program):
            for flag in ("--help", "--version", "--dump-config"):
                answer = run(program, flag)
                self.assertEqual((answer.returncode, answer.stderr), (0, ""), flag)
                self.assertTrue(answer.stdout.strip(), flag)
        self.for_each(self.services(), check)

    def test_every_program_names_its_commit(self):
        def check(program):
            answer = run(program, "--version")
            self.assertEqual((answer.returncode, answer.stderr), (0, ""))
            self.assertRegex(answer.stdout, r"^\d+\.\d+\.\d+ \(commit [0-9a-z-]+\)\n$")
        self.for_each(programs(), check)

    def test_the_command_beside_a_service_has_help(self):
        if "perception" not in SERVICES:
            self.skipTest("skipped: this build has no perception")
        answer = run("chase-perception", "--learn-colour", "--help")
        self.assertEqual((answer.returncode, answer.stderr), (0, ""))
        self.assertIn("IMAGE MASK", answer.stdout)
        self.assert_refused(run("chase-perception", "--learn-colour"), "pairs of IMAGE MASK")

    def test_output_that_cannot_be_written(self):
        commands = [(program, "--help") for program in programs()] + [(program, "--dump-config") for program in self.services()]
        if TOOL_SERVICES <= set(SERVICES):
            scenes = TESTS.parent / "deploy/scenarios/scenes"
            commands += [("chase-plan", scenes / "gap.yaml"), ("chase-predict", scenes / "predict_turn.yaml"),
                         ("chase-scenario", "gym"), ("chase-world", "grove"), ("chase-campaign", "--out", "no/such", "--list")]
        for program, *arguments in commands:
            with self.subTest(program=program, arguments=arguments), open("/dev/full", "w", encoding="utf-8") as full:
                answer = subprocess.run([BIN / program, *arguments], stdout=full, stderr=subprocess.PIPE, text=True,
                                        timeout=LIMIT, check=False)
                self.assertEqual(answer.returncode, 1, answer.stderr)
                self.assertIn("standard output could not be written; is the disk full?\n", answer.stderr)

    def test_help_of_which_only_the_first_line_is_read(self):
        commands = [[BIN / program] for program in programs()] + [self.command(script) for script in SCRIPTS]
        for command in commands:
            for flag in ("--help", "--version"):
                with self.subTest(command=command, flag=flag):
                    reader, writer = os.pipe()
                    os.close(reader)
                    answer = subprocess.run([*command, flag], stdout=writer, stderr=subprocess.PIPE, text=True, timeout=LIMIT,
                                            check=False)
                    os.close(writer)
                    self.assertEqual(answer.stderr, "")

    def test_every_program_refuses_what_it_does_not_know(self):
        self.for_each(programs(), lambda program: self.assert_refused(
            run(program, "--no-such-flag"), pathlib.Path(program).name))

    @staticmethod
    def command(script):
        path = TESTS.parent / script
        return [path] if os.access(path, os.X_OK) else [sys.executable, "-B", path]

    def call(self, script, *arguments):
        return subprocess.run([*self.command(script), *arguments], check=False, capture_output=True, text=True, timeout=LIMIT)

    def test_scripts_name_their_commit(self):
        self.assertGreater(len(SCRIPTS), 30)
        for script in SCRIPTS:
            with self.subTest(script=script):
                answer = self.call(script, "--version")
                self.assertEqual((answer.returncode, answer.stderr), (0, ""))
                self.assertRegex(answer.stdout, r"^\d+\.\d+\.\d+ \(commit [0-9a-z-]+\)\n$")

    def test_scripts_have_help(self):
        for script in SCRIPTS:
            for flag in ("-h", "--help"):
                with self.subTest(script=script, flag=flag):
                    answer = self.call(script, flag)
                    self.assertEqual((answer.returncode, answer.stderr), (0, ""))
                    self.assertGreater(len(answer.stdout), 40)
                    self.assertEqual(self.call(script, flag, "x").stdout, answer.stdout)

    def test_scripts_have_help_behind_other_words(self):
        for script in ("deploy/build", "deploy/doctor", "test/baselines/halton.py", "test/fuzz/make_corpus", "test/run"):
            with self.subTest(script=script):
                self.assertEqual(self.call(script, "x", "--help").stdout, self.call(script, "--help").stdout)

    def test_dumped_config_loads_again(self):
        def check(program):
            dump = run(program, "--dump-config").stdout
            again = run(program, "--config", self.file(dump), "--dump-config")
            self.assertEqual((again.stdout, again.stderr), (dump, ""))
        self.for_each(self.services(), check)

    def test_unknown_key(self):
        def check(program):
            path = self.file("# one\n\nno_such_key: 1\n")
            self.assert_refused(run(program, "--config", path), f"{path}:3", "no_such_key")
        self.for_each(self.services(), check)

    def test_wrong_type(self):
        def check(program):
            keys = first_scalar(run(program, "--dump-config").stdout)
            path = self.file(nested(keys, "{not: a scalar}"))
            self.assert_refused(run(program, "--config", path), path, keys[-1])
        self.for_each(self.services(), check)

    def test_not_yaml(self):
        def check(program):
            path = self.file("a: [1, 2\nb: }\n")
            self.assert_refused(run(program, "--config", path), path)
        self.for_each(self.services(), check)

    def test_missing_config(self):
        self.for_each(self.services(), lambda program: self.assert_refused(
            run(program, "--config", "no/such.yaml"), "no/such.yaml"))

    def test_bad_flag(self):
        self.for_each(self.services(), lambda program: self.assert_refused(
            run(program, "--no-such-flag"), "--no-such-flag", "--help"))

    def test_bad_url(self):
        self.for_each(self.services(), lambda program: self.assert_refused(
            run(program, "--lcm-url", "udpm://nonsense"), "udpm://nonsense"))

    def test_address_that_is_not_multicast(self):
        self.for_each(self.services(), lambda program: self.assert_refused(
            run(program, "--lcm-url", "udpm://10.0.0.1:7667?ttl=0"), "no multicast address",
            "239.255.76.67"))

    def test_bad_port(self):
        for place in ("239.255.76.67:0", "239.255.76.67:65536", f"239.255.76.67:{10**20}", ":7667"):
            self.for_each(self.services(), lambda program: self.assert_refused(
                run(program, "--lcm-url", f"udpm://{place}"), "ADDRESS:PORT"))

    def test_missing_replay(self):
        out = pathlib.Path(self.folder.name) / "out.lcm"
        self.for_each(self.replayable(), lambda program: self.assert_refused(
            run(program, "--replay", "no/such.lcm", "--out", out), "no/such.lcm"))

    def test_replay_without_out(self):
        self.for_each(self.replayable(), lambda program: self.assert_refused(
            run(program, "--replay", "no/such.lcm"), "--out"))

    def test_replay_of_what_is_live_only(self):
        cures = {"lidar": "source", "camera": "source", "fcu": "chase-log", "link": "chase-viewer --play", "recorder": "chase-log"}
        for name in [*(name for name in LIVE if name in SERVICES), "recorder"]:
            for more in ((), ("--out", "b.lcm")):
                with self.subTest(name=name, more=more):
                    self.assert_refused(run(f"chase-{name}", "--replay", "a.lcm", *more), f"chase-{name}: --replay: ", cures[name])

    def test_out_without_replay(self):
        self.for_each(self.replayable(), lambda program: self.assert_refused(
            run(program, "--out", "no/such.lcm"), "--out", "--replay"))

    def test_options_that_would_do_nothing(self):
        def check(program):
            for words in (("--lcm-url", "udpm://239.255.76.67:7667"), ("--key-file", "a.key")):
                self.assert_refused(run(program, "--replay", "a.lcm", "--out", "b.lcm", *words), words[0], "--replay")
        self.for_each(self.replayable(), check)
        for program, *words in (("chase-viewer", "--play", "--lcm-url"), ("chase-viewer", "--play", "--token-file"),
                                ("chase-viewer", "--play", "--channel-prefix"), ("chase-viewer", "--play", "--key-file"),
                                ("chase-viewer", "--play", "--replay")):
            with self.subTest(program=program, words=words):
                self.assert_refused(run(program, *[w for word in words for w in (word, "a.file")]), *words)
        self.assert_refused(run("chase-command", "land", "--timeout", "5"), "--timeout", "--wait")
        if TOOL_SERVICES <= set(SERVICES):
            self.assert_refused(run("chase-flight", "gym", "--print-config", "planning", "--log", "a.lcm"), "--print-config", "--log")
            self.assert_refused(run("chase-campaign", "--out", "no/such", "--fly", "--compare", "a"), "--fly", "--compare")
            self.assert_refused(run("chase-compare", "--list", "--result", "a.json"), "--result", "--fly")
            self.assert_refused(run("chase-compare", "--list", "--fly", "S1"), "--list", "--fly")

    def test_port_in_use(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
            taken.bind(("", 0))  # without SO_REUSEADDR: not shared
            port = taken.getsockname()[1]
            self.for_each(self.services(), lambda program: self.assert_refused(
                run(program, "--lcm-url", f"udpm://239.255.76.67:{port}?ttl=0"), port, "in use"))

    def test_missing_route(self):
        bare = ["unshare", "--net"]
        if subprocess.run([*bare, "true"], capture_output=True, check=False).returncode:
            self.skipTest("skipped: no right to make a network namespace")

        def check(program):
            answer = subprocess.run([*bare, BIN / program], capture_output=True, text=True,
                                    timeout=LIMIT, check=False)
            self.assert_refused(answer, "ip route add")
        self.for_each(self.services(), check)

    def tools(self):
        if not TOOL_SERVICES <= set(SERVICES):
            self.skipTest("skipped: this build has not all services")
        return TOOLS

    def test_tools_numbers_that_are_none(self):
        self.tools()
        gym = TESTS.parent / "deploy/scenarios/gym.yaml"
        for command, values in ((["chase-flight", gym, "--until"], ("nan", -20, 0, "inf", "1s")),
                                (["chase-flight", gym, "--seed"], ("nan", -1, 1.5, 2**31, 10**20)),
                                (["chase-flight", gym, "--fault"],
                                 ("kill-simulator", "lidar-gap@60", "lidar-gap@-9", "kill-control@")),
                                (["chase-compare", "--jobs"], ("nan", 0, 1.5, 10**20)),
                                (["chase-campaign", "--out", "no/such", "--jobs"], ("nan", 0, 1.5)),
                                (["chase-campaign", "--out", "no/such", "--duration"],
                                 ("nan", -1, 0, "inf")),
                                (["chase-log", "diff", "a.lcm", "b.lcm", "--tolerance"],
                                 ("nan", -1, "inf", "x"))):
            for value in values:
                with self.subTest(command=command, value=value):
                    self.assert_refused(run(*command, value), command[-1], value,
                                        code=2 if "diff" in command else 1)

    def test_tools_file_that_cannot_be_written(self):
        self.tools()
        gym = TESTS.parent / "deploy/scenarios/gym.yaml"
        for flag in ("--metrics", "--log"):
            self.assert_refused(run("chase-flight", gym, flag, "/no/such/file"), "/no/such/file")

    def test_tools_output_that_is_the_input(self):
        self.tools()
        log = self.file("").with_name("flight.lcm.tmp")  # what flight.lcm is while being written
        log.write_bytes(bytes.fromhex("eda1da01"))
        for out in (log, log.with_suffix("")):
            self.assert_refused(run("chase-log", "migrate", log, out), log, "name another")
        self.assertEqual(log.read_bytes(), bytes.fromhex("eda1da01"))

    def test_scripts(self):
        nothing = self.file("[]")
        for script, *arguments in (
                ("compare/table.py",), ("compare/table.py", "no/such.json"),
                ("compare/table.py", "README.md"), ("compare/table.py", nothing),
                ("baselines/choose_best.py",), ("baselines/choose_best.py", "no/such.json"),
                ("baselines/choose_best.py", "README.md"), ("baselines/choose_best.py", nothing),
                ("replay/golden.py",), ("replay/golden.py", "show"), ("replay/golden.py", "check"),
                ("replay/golden.py", "check", BIN, "no/such.yaml", "nobody"),
                ("replay/golden.py", "check", "no/bin", "no/such.yaml", "planning"),
                ("replay/golden.py", "record", BIN, "no/such.yaml", "no/such.lcm", "planning"),
                ("replay/golden.py", "record", BIN, "no/such.yaml", "README.md", "planning"),
                ("replay/replay_check.py", BIN), ("package/scenes.py",), ("unit/mcap_size_test.py", BIN),
                ("baselines/halton.py", "sets.csv"), ("baselines/halton.py", "--no-such"),
                ("flight/calibration",), ("flight/calibration", "--no-such"),
                ("flight/calibration", "no/such.lcm"), ("flight/calibration", TESTS.parent / "README.md"),
                ("flight/in_namespace.sh",), ("flight/in_namespace.sh", "--no-such"), ("flight/lockstep.sh", BIN),
                ("fuzz/make_corpus", "--no-such"), ("../deploy/build", "--no-such"), ("../deploy/cli_pages.py", BIN),
                ("../deploy/systemd/units.py",), ("../deploy/package/contents.py", BIN)):
            with self.subTest(script=script, arguments=arguments):
                self.assert_refused(self.call(TESTS / script, *map(str, arguments)), pathlib.Path(script).name)

    def test_tools_bad_flag(self):
        self.for_each(self.tools(), lambda program: self.assert_refused(
            run(program, "no/such.file", "--no-such-flag")))
        for program in ("chase-plan", "chase-predict", "chase-world", "chase-scenario", "chase-report"):
            with self.subTest(program=program):
                self.assert_refused(run(program), f"see {program} --help")

    def test_tools_missing_file(self):
        self.for_each(self.tools(), lambda program: self.assert_refused(
            run(program, "no/such.file"), "no/such.file"))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
