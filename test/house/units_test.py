"""The vehicle's units say what the process table says, and back-off waits as a live flight's launcher does."""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "deploy" / "launcher"))
import processes  # noqa: E402

ROW = {"binary": "chase-odometry", "heavy": True, "fly": True, "vehicle": True, "nice": 0, "priority": 0, "cores": ""}


class Units(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_restart_is_the_tables(self):
        table = self.folder / "table.json"
        table.write_text(json.dumps({"processes": [dict(ROW, name=name, restart=name) for name in ("always", "never")]}),
                         encoding="utf-8")
        subprocess.run([sys.executable, "-B", ROOT / "deploy/systemd/units.py", table, self.folder / "out"], check=True)
        units = {name: (self.folder / f"out/chase-{name}.service").read_text(encoding="utf-8") for name in ("always", "never")}
        said = {name: re.findall(r"^Restart=(.*)$", text, re.MULTILINE) for name, text in units.items()}
        self.assertEqual(said, {"always": ["always"], "never": ["no"]})
        self.assertEqual({name: "ExecStartPre=-/usr/libexec/chase/back-off\n" in text for name, text in units.items()},
                         {"always": True, "never": False})
        self.assertIn("StartLimitIntervalSec=0\n", units["always"], "nothing is given up")

    def start(self):
        """How long it waited, s: a stand-in for sleep tells, and does not."""
        sleep = self.folder / "sleep"
        sleep.write_text(f"#!/bin/sh\necho $1 >> {self.folder}/slept\n", encoding="utf-8")
        sleep.chmod(0o755)
        answer = subprocess.run([ROOT / "deploy/systemd/back-off"], capture_output=True, text=True, timeout=60, check=False,
                                env={"PATH": f"{self.folder}:{os.environ['PATH']}", "RUNTIME_DIRECTORY": str(self.folder)})
        self.assertEqual((answer.returncode, answer.stdout, answer.stderr), (0, "", ""))
        slept = self.folder / "slept"
        waited = float(slept.read_text(encoding="utf-8")) if slept.exists() else 0.0
        slept.unlink(missing_ok=True)
        return waited

    def live(self, seconds):
        """As if it had lived that long since its start."""
        starts = self.folder / "starts"
        last, short = starts.read_text(encoding="utf-8").split()
        starts.write_text(f"{int(last) - seconds} {short}\n", encoding="utf-8")

    def test_waits_like_the_launcher(self):
        self.assertEqual(self.start(), 0.0, "the first start")
        longest = processes.BACK_OFF[-1]
        self.assertEqual([self.start() for _ in range(7)], [*processes.BACK_OFF, longest, longest])
        self.live(int(processes.SHORT_LIFE) + 60)
        self.assertEqual([self.start() for _ in range(3)], [0.0, *processes.BACK_OFF[:2]], "it lived long enough")

    def test_never_hinders_a_start(self):
        for text in ("", "x\n", "1 2 3\n", "-5 b\n", "\0\n"):
            (self.folder / "starts").write_text(text, encoding="utf-8")
            self.assertEqual(self.start(), 0.0, repr(text))


if __name__ == "__main__":
    unittest.main()
