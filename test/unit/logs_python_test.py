#!/usr/bin/env python3
"""The Python reader against chase-log, damaged logs, and every example of its page.

logs_python_test.py BIN_DIR"""

import collections
import csv
import importlib.util
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(sys.argv[1]).resolve()
MODULES = BIN.parent / "share/chase/python"
sys.dont_write_bytecode = True
sys.path.insert(0, str(MODULES))
import chase_log  # noqa: E402

DEBIANS = "/usr/bin/python3"  # deploy/setup installs pandas for it
EXAMPLE = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


class Python(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = pathlib.Path(cls.temporary.name)
        cls.log = cls.folder / "flight.lcm"
        subprocess.run([BIN / "chase-flight", ROOT / "deploy/scenarios/gym.yaml", "--until", "1", "--quiet",
                        "--sensors", "truth", "--log", cls.log], check=True, capture_output=True)

    def test_agrees_with_the_csv_of_chase_log(self):
        subprocess.run([BIN / "chase-log", "export", "--csv", self.log, self.folder / "csv"], check=True,
                       capture_output=True)
        for channel in ("POSE", "TRUTH", "ATTITUDE_SETPOINT", "PLAN", "TARGET"):
            with (self.folder / f"csv/{channel}.csv").open(encoding="utf-8") as file:
                rows = list(csv.DictReader(file))
            ours = chase_log.table(self.log, channel)
            self.assertEqual(len(ours), len(rows), channel)
            self.assertGreater(len(ours), 5, channel)
            for row, mine in zip(rows, ours):
                self.assertEqual(int(row["utime"]), mine["utime"])
                self.assertEqual(int(row["seq"]), mine["seq"])

    def test_every_message_is_decoded(self):
        unknown = {e.channel for e in chase_log.read(self.log) if isinstance(e.message, bytes)}
        self.assertEqual(unknown, set())

    def test_a_flights_folder_stands_for_its_log(self):
        self.assertEqual(list(chase_log.table(self.folder, "POSE")), list(chase_log.table(self.log, "POSE")))
        self.assertRaises(FileNotFoundError, lambda: next(chase_log.read(self.folder / "no")))

    def test_damage_is_told_as_chase_log_does(self):
        data, damage = self.log.read_bytes(), []
        at = data.index(b"\xed\xa1\xda\x01", len(data) // 2)
        bad = self.folder / "told.lcm"
        bad.write_bytes(data[:at] + b"none" + data[at + 4:-10])
        counts = [sum(1 for _ in chase_log.read(bad, *channels, damage=damage)) for channels in ((), ("POSE",))]
        self.assertLess(counts[1], counts[0])
        self.assertEqual(damage[:2], damage[2:])
        (first, size), (_, end) = damage[:2]
        info = subprocess.run([BIN / "chase-log", "info", bad], check=True, capture_output=True, text=True).stdout
        self.assertIn(f"{size} bytes at {first} are no whole event", info)
        self.assertIn(f"the last {end} bytes are no whole event", info)

    def test_damage_costs_what_is_damaged(self):
        data = self.log.read_bytes()
        whole = sum(1 for _ in chase_log.read(self.log))
        damaged = self.folder / "damaged.lcm"
        middle = len(data) // 2
        for bad, least in ((data[:-3], whole - 1), (data[:middle] + bytes(100) + data[middle + 100:], whole - 3),
                           (data[:middle] + data[middle + 1000:], whole - 40)):
            damaged.write_bytes(bad)
            self.assertGreaterEqual(sum(1 for _ in chase_log.read(damaged)), least)

    def test_a_file_that_is_no_log_is_refused_as_chase_log_does(self):
        file = self.folder / "none.lcm"
        for bad, words in ((b"", "is empty"), (b"no log at all" * 9, "is no LCM log")):
            file.write_bytes(bad)
            with self.assertRaisesRegex(ValueError, f"none.lcm: {words}"):
                next(chase_log.read(file))
            self.assertEqual(subprocess.run([BIN / "chase-log", "info", file], check=False, capture_output=True).returncode, 1)

    def test_a_log_whose_first_bytes_are_damaged_is_read(self):
        bad, damage = self.folder / "first.lcm", []
        bad.write_bytes(b"none" + self.log.read_bytes()[4:])
        whole = sum(1 for _ in chase_log.read(self.log))
        self.assertEqual(sum(1 for _ in chase_log.read(bad, damage=damage)), whole - 1)
        self.assertEqual(damage[0][0], 0)

    def test_a_channel_that_the_log_lacks_is_refused(self):
        for names in (("POES",), ("POSE", "POES")):
            with self.assertRaisesRegex(ValueError, r"holds nothing on POES; its channels: .*IMU, .*POSE"):
                list(chase_log.read(self.log, *names))
        self.assertRaises(ValueError, chase_log.table, self.log, "POES")

    def test_messages_that_cannot_be_read_are_told(self):
        data = self.log.read_bytes()
        at = next(m.end() for m in re.finditer(rb"\xed\xa1\xda\x01.{24}POSE", data, re.DOTALL))
        bad = self.folder / "unread.lcm"
        bad.write_bytes(data[:at] + bytes(8) + data[at + 8:])
        with self.assertWarnsRegex(UserWarning, r"POSE: 1 message cannot be read"):
            self.assertEqual(len(chase_log.table(bad, "POSE")), len(chase_log.table(self.log, "POSE")) - 1)

    def test_damage_costs_what_it_costs_chase_log(self):
        data, draw = self.log.read_bytes(), random.Random(5)
        starts = [found.start() for found in re.finditer(rb"\xed\xa1\xda\x01", data)]
        damaged = self.folder / "drawn.lcm"
        for round_ in range(25):
            bad = bytearray(data)
            for at in draw.sample(starts, 3):
                at += draw.choice((0, 12, 20, 23, 24, 25, 26, 27, 30))  # sync, stamp, lengths, name
                bad[at] ^= 1 << draw.randrange(8)
            damaged.write_bytes(bad[:draw.choice((None, draw.randrange(len(bad))))])
            info = subprocess.run([BIN / "chase-log", "info", damaged], check=True, capture_output=True, text=True).stdout
            counts = {words[0]: int(words[2]) for line in info.splitlines() if " Hz " in line for words in [line.split()]}
            with self.subTest(round=round_):
                self.assertEqual(collections.Counter(event.channel for event in chase_log.read(damaged)), counts)
                some = max(counts, key=counts.get)
                self.assertEqual(sum(1 for _ in chase_log.read(damaged, some)), counts[some])

    @staticmethod
    def python_for(text):
        """The interpreter that runs an example: this one, or Debian's where it needs what this one has not."""
        return DEBIANS if "import pandas" in text and importlib.util.find_spec("pandas") is None else sys.executable

    def test_the_examples_of_the_page_run(self):
        examples = EXAMPLE.findall((ROOT / "logs/python/README.md").read_text(encoding="utf-8"))
        self.assertEqual(len(examples), 4)
        for number, text in enumerate(examples):
            with self.subTest(number=number):
                text = text.replace("build/bin", str(BIN)).replace("deploy/", f"{ROOT}/deploy/")
                file = self.folder / f"example{number}.py"
                file.write_text(text, encoding="utf-8")
                answer = subprocess.run([self.python_for(text), "-B", file, self.log], cwd=self.folder, check=False,
                                        capture_output=True, text=True,
                                        env={**os.environ, "PYTHONPATH": str(MODULES)})
                if "No module named 'pandas'" in answer.stderr:
                    self.skipTest("skipped: no pandas; cure: deploy/setup")
                self.assertEqual(answer.returncode, 0, answer.stderr)
        self.assertGreater((self.folder / "path.png").stat().st_size, 1000)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
