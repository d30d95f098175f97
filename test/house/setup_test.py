"""deploy/setup with stand-ins for apt-get, dpkg-query, npm and id: nothing is installed."""

import pathlib
import shutil
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Setup(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.home = pathlib.Path(folder.name)
        (self.home / "deploy").mkdir()
        shutil.copy(ROOT / "deploy" / "setup", self.home / "deploy" / "setup")
        self.bin = self.home / "bin"
        self.bin.mkdir()
        for tool in ("env", "bash", "dirname", "sed", "sort", "comm", "cmp", "cp", "mkdir", "echo"):
            (self.bin / tool).symlink_to(shutil.which(tool))
        self.program("id", "echo 0")
        self.program("npm", f'echo "npm $*" >> {self.home}/calls; mkdir -p $3/node_modules')
        self.program("apt-get", f'echo "apt-get $*" >> {self.home}/calls')
        self.installed("all")

    def program(self, name, script):
        path = self.bin / name
        path.write_text(f"#!/bin/bash\n{script}\n", encoding="utf-8")
        path.chmod(0o755)

    def installed(self, which):
        """dpkg-query says that all packages are installed, or all but the ones given."""
        self.program("dpkg-query", 'for p in "${@:4}"; do case " %s " in *" $p "*) ;; '
                     '*) echo "installed $p" ;; esac; done' % which)

    def setup_script(self, *arguments):
        return subprocess.run([self.home / "deploy" / "setup", *arguments], capture_output=True,
                              text=True, env={"PATH": str(self.bin)}, check=False)

    def calls(self):
        path = self.home / "calls"
        return path.read_text(encoding="utf-8").splitlines() if path.exists() else []

    def test_does_nothing_when_all_is_there(self):
        answer = self.setup_script()
        self.assertEqual((answer.returncode, answer.stdout, answer.stderr), (0, "", ""))
        self.assertEqual(self.calls(), [])

    def test_installs_what_is_missing(self):
        self.installed("liblcm-dev cmake")
        self.assertEqual(self.setup_script().returncode, 0)
        self.assertEqual(self.calls()[0], "apt-get update -q")
        self.assertTrue(self.calls()[1].endswith("--no-install-recommends cmake liblcm-dev"))

    def test_names_what_is_missing(self):
        self.installed("liblcm-dev cmake")
        self.assertEqual(self.setup_script("--check").stdout, "cmake\nliblcm-dev\n")
        self.assertEqual(self.calls(), [])

    def test_needs_npm_only_where_it_is_missing(self):
        (self.bin / "npm").unlink()
        self.installed("npm")
        self.assertEqual(self.setup_script("--check").stdout, "npm\n")

    def test_without_root(self):
        self.installed("cmake")
        self.program("id", "echo 1000")
        answer = self.setup_script()
        self.assertEqual(answer.returncode, 1)
        self.assertIn("needs root", answer.stderr)

    def test_without_network(self):
        self.installed("cmake")
        self.program("apt-get", "exit 100")
        answer = self.setup_script()
        self.assertEqual(answer.returncode, 1)
        self.assertIn("check the network", answer.stderr)

    def test_node_modules_once_per_lock_file(self):
        for folder in ("logs", "common/mavlink", "services/viewer"):
            with self.subTest(folder=folder):
                path = self.home / folder
                path.mkdir(parents=True)
                before = len(self.calls())
                for text, expected in (("{}", 1), ("{}", 1), ("{1}", 2)):
                    (path / "package-lock.json").write_text(text, encoding="utf-8")
                    self.assertEqual(self.setup_script().returncode, 0)
                    self.assertEqual(len(self.calls()) - before, expected)
                self.assertIn(f"npm ci --prefix {folder} ", self.calls()[-1])

    def test_unknown_argument(self):
        self.assertEqual(self.setup_script("--what").returncode, 1)


if __name__ == "__main__":
    unittest.main()
