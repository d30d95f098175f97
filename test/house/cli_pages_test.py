#!/usr/bin/env python3
"""Completions and man pages name every option of every program, and bash and man can read them.

cli_pages_test.py BIN_DIR"""

import gzip
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(sys.argv[1]).resolve()


def run(*command, **more):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False, **more)


class Pages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.out = pathlib.Path(cls.temporary.name)
        answer = run(sys.executable, "-B", ROOT / "deploy/cli_pages.py", BIN, cls.out)
        assert answer.returncode == 0, answer.stderr
        cls.programs = sorted(path.name for path in BIN.glob("chase-*"))

    def completion(self, program):
        return self.out / "share/bash-completion/completions" / program

    def complete(self, *words):
        """What is offered for the last word."""
        script = f"source {self.completion(words[0])}; COMP_WORDS=({' '.join(words[:-1])} '{words[-1]}'); " \
                 f"COMP_CWORD={len(words) - 1}; _{words[0].replace('-', '_')}; printf '%s\\n' \"${{COMPREPLY[@]}}\""
        return [line for line in run("bash", "-c", script, cwd=self.out).stdout.splitlines() if line]

    def test_every_option_is_there(self):
        self.assertGreater(len(self.programs), 5)
        for program in self.programs:
            options = set(re.findall(r"^\s+(?:-\w,)?(--[\w-]+)", run(BIN / program, "--help").stdout.split("Usage:")[1], re.M))
            self.assertIn("--version", options, program)
            page = (self.out / f"share/man/man1/{program}.1").read_text(encoding="utf-8").replace("\\-", "-")
            self.assertIn(f".SH SYNOPSIS\n{program} [OPTIONS]", page)
            self.assertNotIn(" --", page.split(".SH SYNOPSIS")[0], f"{program}: an option in its NAME")
            for option in options:
                self.assertIn(option, self.complete(program, "--"), program)
                self.assertIn(option, page, program)

    def test_bash_and_man_read_them(self):
        for program in self.programs:
            self.assertEqual(run("bash", "-n", self.completion(program)).stderr, "", program)
            if shutil.which("man"):
                answer = run("man", "--warnings", "-l", self.out / f"share/man/man1/{program}.1",
                             env={"MANWIDTH": "80", "LC_ALL": "C.UTF-8", "PATH": "/usr/bin:/bin"})
                self.assertEqual((answer.returncode, answer.stderr), (0, ""), program)

    def test_choices_and_subcommands(self):
        self.assertEqual(self.complete("chase-log", "ex"), ["export"])
        self.assertIn("--tum", self.complete("chase-log", "export", "--"))
        self.assertIn("takeoff", self.complete("chase-command", "ta"))
        self.assertEqual(self.complete("chase-flight", "--sensors", "tr"), ["truth"])
        self.assertEqual(self.complete("chase-log", "import", "vl"), ["vlp16"])

    def test_packaged_scripts_name_every_option(self):
        (self.out / "bin").symlink_to(BIN)
        answer = run(sys.executable, "-B", ROOT / "deploy/package/contents.py", self.out, self.out / "package", "1.0")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        for name in ("fly", "doctor", "spy"):
            options = {"--help", "--version", *re.findall(r"(?<![\w-])--[a-z][a-z-]+", run(ROOT / "deploy" / name, "--help").stdout)}
            page = gzip.decompress((self.out / f"package/man1/chase-{name}.1.gz").read_bytes()).decode().replace("\\-", "-")
            completion = self.out / f"package/completions/chase-{name}"
            answer = run("bash", "-c", f"source {completion}; complete -p chase-{name}").stdout
            for option in options:
                self.assertRegex(page, rf"{option}\b", f"chase-{name}.1")
                self.assertRegex(answer, rf"[' ]{option}[' ]", f"chase-{name}")

    def test_numbers_are_no_files(self):
        (self.out / "1.lcm").touch()
        for words in (("chase-log", "cut", "--from"), ("chase-flight", "--seed")):
            self.assertEqual(self.complete(*words, "1"), [], words)
        self.assertEqual(self.complete("chase-log", "info", "1"), ["1.lcm"])
        self.assertEqual(self.complete("chase-flight", "--log", "1"), ["1.lcm"])

    def test_names_of_files_may_hold_blanks(self):
        (self.out / "two words.lcm").touch()
        for words in (("chase-log", "info"), ("chase-flight", "--log")):
            self.assertEqual(self.complete(*words, "two"), ["two words.lcm"], words)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
