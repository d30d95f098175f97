"""Skipped tests are told to CTest, and hide no failure. skips_test.py BUILD_DIR PROGRAM: a GoogleTest program
that passes, skips, fails or dies as it is asked to."""

import json
import pathlib
import subprocess
import sys
import tempfile
import textwrap
import unittest

BUILD, PROGRAM = (pathlib.Path(word).resolve() for word in sys.argv[1:])
RUNNER = pathlib.Path(__file__).resolve().parents[1] / "unittest_run.py"
SKIPPED = 77
SCRIPT = """
    import os, unittest
    class Cases(unittest.TestCase):
        def test_passes(self): pass
        def test_skips(self): self.skipTest("no camera") if "skip" in {what} else None
        def test_fails(self): self.assertNotIn("fail", {what})
        def test_errs(self): 1 / (0 if "err" in {what} else 1)
        def test_dies(self): os.abort() if "die" in {what} else None
    unittest.main(argv=["x"])
    """


def run(*command):
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=60, check=False)


class Skips(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def script(self, *what):
        path = self.folder / "cases.py"
        path.write_text(textwrap.dedent(SCRIPT.format(what=repr(what))), encoding="utf-8")
        return run(sys.executable, "-B", RUNNER, path)

    def program(self, *what):
        return run(PROGRAM, "--gtest_also_run_disabled_tests",
                   "--gtest_filter=" + ":".join(f"Ask.DISABLED_{name.title()}" for name in ("pass", *what)))

    def test_exit_codes(self):
        for runner in (self.script, self.program):
            with self.subTest(runner=runner.__name__):
                self.assertEqual(runner().returncode, 0)
                self.assertEqual(runner("skip").returncode, SKIPPED)
                for bad in ("fail", "die"):
                    for what in ((bad,), ("skip", bad)):
                        self.assertNotIn(runner(*what).returncode, (0, SKIPPED), what)
        self.assertNotIn(self.script("skip", "err").returncode, (0, SKIPPED))
        self.assertIn("no camera", self.script("skip").stdout)

    def test_ctest_says_so(self):
        (self.folder / "CTestTestfile.cmake").write_text("".join(
            f'add_test({name} "{PROGRAM}" "--gtest_also_run_disabled_tests" "--gtest_filter={cases}")\n'
            f'set_tests_properties({name} PROPERTIES SKIP_RETURN_CODE {SKIPPED})\n'
            for name, cases in (("skips", "Ask.DISABLED_Pass:Ask.DISABLED_Skip"),
                                ("fails", "Ask.DISABLED_Fail:Ask.DISABLED_Skip"))), encoding="utf-8")
        answer = run("ctest", "--test-dir", self.folder)
        self.assertRegex(answer.stdout, r"skips \.+\*\*\*Skipped")
        self.assertRegex(answer.stdout, r"fails \.+\*\*\*Failed")
        self.assertNotEqual(answer.returncode, 0)

    def test_every_test_that_may_skip_tells(self):
        tests = json.loads(run("ctest", "--test-dir", BUILD, "--show-only=json-v1").stdout)["tests"]
        self.assertGreater(len(tests), 10)
        for test in tests:
            words = test.get("command", [])
            tells = any(p["name"] == "SKIP_RETURN_CODE" and p["value"] == SKIPPED for p in test["properties"])
            scripts = [w for w in words if w.endswith(".py") and "import unittest" in
                       pathlib.Path(w).read_text(encoding="utf-8") and pathlib.Path(w) != RUNNER]
            if scripts or (words and words[0].startswith(f"{BUILD}/test/") and words[0].endswith("_test")):
                self.assertTrue(tells, test["name"])
            if scripts:
                self.assertIn(str(RUNNER), words, test["name"])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
