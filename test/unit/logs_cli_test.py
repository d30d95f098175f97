"""chase-log and chase-report as a user calls them, on the log of a short flight.

logs_cli_test.py BIN_DIR"""

import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test/replay"))
sys.dont_write_bytecode = True
import lcmlog  # noqa: E402

BIN = pathlib.Path(sys.argv[1]).resolve()
LIMIT = 60  # s


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
        cls.events = list(lcmlog.read(cls.log))

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
        self.assertEqual(len(texts["TRUTH"].splitlines()), self.count("TRUTH"))
        self.good("export", "--tum", self.log, self.folder / "default.tum")
        self.assertEqual((self.folder / "default.tum").read_text(), texts["POSE"])

    def test_options_without_effect_are_refused(self):
        out = self.folder / "refused"
        for words, arguments in (
                (("--channel", "IMU", "POSE"), ("--tum", "--channel", "IMU")),
                (("--channel", "NO_SUCH", "info"), ("--csv", "--channel", "NO_SUCH")),
                (("--channel", "NO_SUCH", "info"), ("--mcap", "--channel", "NO_SUCH"))):
            with self.subTest(arguments=arguments):
                answer = run("chase-log", "export", *arguments, self.log, out)
                self.assert_refused(answer, 2, *words)
                self.assertFalse(out.exists())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
