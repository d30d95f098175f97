#!/usr/bin/env python3
"""The Debian package: made, judged by lintian, unpacked, its units read by systemd, a flight from its files.

deb_test.py BUILD"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(sys.argv[1]).resolve()
ROWS = json.loads((ROOT / "deploy/processes.json").read_text(encoding="utf-8"))["processes"]
VEHICLE = sorted(row["name"] for row in ROWS if row["vehicle"])


def run(*command, **more):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False, **more)


class Deb(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        folder = pathlib.Path(cls.temporary.name)
        # Light compression: the test is not about size.
        made = run("cpack", "--config", BUILD / "CPackConfig.cmake", "-B", folder / "made",
                   "-D", "CPACK_DEBIAN_COMPRESSION_TYPE=gzip", cwd=folder)
        if made.returncode:
            raise AssertionError(f"cpack: {made.stdout}{made.stderr}; cure: deploy/build -- package_contents")
        (cls.deb,) = (folder / "made").glob("chase_*.deb")
        cls.root = folder / "root"
        run("dpkg-deb", "-x", cls.deb, cls.root)
        run("dpkg-deb", "-e", cls.deb, cls.root / "DEBIAN")

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def files(self):
        return [path for path in self.root.rglob("*") if path.is_file() and not path.is_symlink()]

    def unit(self, name):
        return (self.root / "lib/systemd/system" / name).read_text(encoding="utf-8")

    def test_lintian_finds_no_error(self):
        if not shutil.which("lintian"):
            self.skipTest("skipped: no lintian")
        answer = run("lintian", "--fail-on", "error,warning", self.deb)
        self.assertEqual((answer.returncode, answer.stdout), (0, ""))

    def test_configuration_is_the_users(self):
        told = (self.root / "DEBIAN/conffiles").read_text(encoding="utf-8").split()
        there = ["/" + str(path.relative_to(self.root)) for path in (self.root / "etc").rglob("*") if path.is_file()]
        self.assertEqual(sorted(told), sorted(there))
        self.assertEqual(sorted(path.stem for path in (self.root / "etc/chase").glob("*.yaml")), VEHICLE)

    def test_files_of_parameters_override_nothing_and_show_all(self):
        for name in VEHICLE:
            program, file = self.root / f"usr/bin/chase-{name}", self.root / f"etc/chase/{name}.yaml"
            defaults = run(program, "--dump-config").stdout
            self.assertEqual(run(program, "--config", file, "--dump-config").stdout, defaults, name)
            bare = re.sub(r"^#", "", file.read_text(encoding="utf-8").split("\n\n", 1)[1], flags=re.MULTILINE)
            self.assertEqual(bare, defaults, name)

    def test_units_are_those_of_the_table(self):
        wants = re.search(r"^Wants=(.*)$", self.unit("chase.target"), re.MULTILINE)[1].split()
        self.assertEqual(sorted(wants), [f"chase-{name}.service" for name in VEHICLE])
        self.assertNotIn("simulator", VEHICLE)
        for row in ROWS:
            if row["vehicle"]:
                text = self.unit(f"chase-{row['name']}.service")
                for line in ("Type=notify", "WatchdogSec=5", "User=chase", {"always": "Restart=always", "never": "Restart=no"}[row["restart"]]):
                    self.assertIn(line + "\n", text)
                waits = re.findall(r"^ExecStartPre=-(.*)$", text, re.MULTILINE)
                self.assertEqual([os.access(f"{self.root}{path}", os.X_OK) for path in waits], [True], row["name"])
                self.assertEqual("CPUSchedulingPolicy=fifo" in text, row["name"] in ("control", "fcu"), row["name"])
                self.assertEqual(re.findall(r"^CPUAffinity=(.*)$", text, re.MULTILINE),
                                 [row["cores"]] if row["cores"] else [])

    def test_systemd_reads_the_units(self):
        if not shutil.which("systemd-analyze"):
            self.skipTest("skipped: no systemd-analyze")
        folder = self.root / "checked"  # the same, with the programs where they are now
        folder.mkdir()
        for unit in (self.root / "lib/systemd/system").iterdir():
            text = unit.read_text(encoding="utf-8").replace("=/usr/", f"={self.root}/usr/").replace("=-/usr/", f"=-{self.root}/usr/")
            (folder / unit.name).write_text(text, encoding="utf-8")
        # The unit that it needs, and nothing of the machine's own.
        answer = run("systemd-analyze", "verify", "--man=no", *sorted(folder.iterdir()),
                     env=dict(os.environ, SYSTEMD_UNIT_PATH=f"{folder}:/lib/systemd/system"))
        ours = [line for line in answer.stderr.splitlines() if "chase" in line]
        self.assertEqual((answer.returncode, ours), (0, []))

    def test_nothing_points_to_where_it_was_built(self):
        for path in self.files():
            for place in (ROOT, BUILD):
                self.assertNotIn(str(place).encode(), path.read_bytes(), path)

    def test_flies_from_its_files(self):
        elsewhere = pathlib.Path(self.temporary.name)
        answer = run(self.root / "usr/bin/chase-flight", "gym", "--seed", 1, "--until", 8, "--metrics", "m.json", "--quiet",
                     cwd=elsewhere)
        metrics = json.loads((elsewhere / "m.json").read_text(encoding="utf-8"))
        self.assertEqual(metrics["safe_ratio"], 1.0, answer.stderr)

    def launcher(self, name, *words):
        return run(sys.executable, "-B", self.root / f"usr/share/chase/launcher/{name}.py", *words, cwd="/")

    def test_launchers_know_where_they_are(self):
        version = run(self.root / "usr/bin/chase-flight", "--version").stdout
        for name in ("fly", "doctor"):
            self.assertEqual(self.launcher(name, "--version").stdout, version)
        answer = self.launcher("fly", "no-such")
        self.assertRegex(answer.stderr, "^chase-fly: no scenario 'no-such'; there are: .*gym.*twelve/S12")

    def test_doctor_looks_at_what_is_installed(self):
        said = self.launcher("doctor").stdout
        self.assertRegex(said, r"(?m)^ok +programs +%d start, \d" % len(VEHICLE))
        self.assertRegex(said, r"(?m)configuration +.*/etc/chase")

    def test_spy_finds_its_types(self):
        answer = run(self.root / "usr/bin/chase-spy", "--types")
        self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertTrue(pathlib.Path(answer.stdout.strip()).is_file())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
