"""chase-recorder live, in namespaces of its own: recorder_live_test.py BIN_DIR.

Rotation, SIGTERM and SIGKILL, messages that never came, and a disk that fills up."""

import pathlib
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "deploy" / "launcher"))

import bus  # noqa: E402

BIN = pathlib.Path(sys.argv[1]).resolve()
GROUP, PORT = "239.255.76.67", 7667


def text(word):
    return struct.pack(">i", len(word) + 1) + word.encode() + b"\0"


def message(seq, size=60):
    """What every message of ours begins with, and as many zeros."""
    return (bytes(8) + struct.pack(">qi", 1, seq) + text("tester") + text("") + struct.pack(">qi", 0, 0)
            + bytes(size))


def send(channel, body, number=0):
    bus.send(b"LC02" + struct.pack(">I", number) + channel.encode() + b"\0" + body, GROUP, PORT)


class Live(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def start(self, *options):
        process = subprocess.Popen([BIN / "chase-recorder", "--folder", self.folder, "--name", "a", *options],
                                   stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait)
        self.addCleanup(lambda: process.poll() is None and process.kill())
        deadline = time.monotonic() + 10
        while not list(self.folder.glob("*.lcm")) and time.monotonic() < deadline:
            time.sleep(0.05)
        time.sleep(0.5)
        return process

    def stop(self, process, how=signal.SIGTERM):
        process.send_signal(how)
        return process.wait(10)

    def info(self, log):
        answer = subprocess.run([BIN / "chase-log", "info", log], capture_output=True, text=True, check=False)
        return {line.split()[0]: line.split() for line in answer.stdout.splitlines() if line.strip()}, answer.stdout

    def test_records_rotates_counts_and_ends_cleanly(self):
        process = self.start("--rotate-mb", "0.1")
        for seq in range(600):
            if seq not in (100, 101, 102):
                send("POSE", message(seq, 250), seq)
            time.sleep(0.001)
        time.sleep(1.5)
        self.assertEqual(self.stop(process), 0)
        logs = sorted(self.folder.glob("a*.lcm"))
        self.assertGreaterEqual(len(logs), 2, logs)
        merged = self.folder / "merged.lcm"
        subprocess.run([BIN / "chase-log", "merge", *logs, merged], check=True, capture_output=True)
        rows, words = self.info(merged)
        self.assertEqual(rows["POSE"][2], "597", words)
        self.assertIn("RECORDER_STATUS", rows)
        self.assertNotIn("cut off", words)
        status = subprocess.run([BIN / "chase-log", "export", "--csv", "--channel", "RECORDER_STATUS", merged,
                                 self.folder / "csv"], capture_output=True, text=True, check=True)
        self.assertIn("3 messages lost on the bus, 0 not written",
                      (self.folder / "csv" / "RECORDER_STATUS.csv").read_text(), status.stdout)

    def test_a_killed_one_leaves_a_log(self):
        process = self.start()
        for seq in range(200):
            send("POSE", message(seq), seq)
        time.sleep(1)
        self.stop(process, signal.SIGKILL)
        rows, words = self.info(self.folder / "a.lcm")
        self.assertEqual(rows["POSE"][2], "200", words)

    def test_a_full_disk_is_told_and_survived(self):
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", self.folder], check=True)
        self.addCleanup(subprocess.run, ["umount", self.folder], check=False)
        process = self.start("--keep-free", "1", "--heavy-minutes", "1")
        for seq in range(150):  # 9 MB of images for a disk of 3
            send("CAMERA_IMAGE", message(seq, 60000), seq)
            send("POSE", message(seq), seq)
            time.sleep(0.02)
        time.sleep(1.5)
        self.assertIsNone(process.poll())
        light = self.folder / "a.lcm"
        rows, words = self.info(light)
        self.assertEqual(rows["POSE"][2], "150", words)  # light ones go on
        self.assertIn(b"the disk is nearly full", light.read_bytes())
        with open(self.folder / "filler", "wb", buffering=0) as file:  # somebody else takes the rest
            try:
                while True:
                    file.write(bytes(4096))
            except OSError:
                pass
        for seq in range(150, 350):
            send("POSE", message(seq, 500), seq)
            time.sleep(0.01)
        self.assertIsNone(process.poll())
        (self.folder / "filler").unlink()
        time.sleep(2.5)
        for seq in range(350, 400):
            send("POSE", message(seq), seq)
        time.sleep(1.5)
        self.assertEqual(self.stop(process), 0)
        seen, everything = 0, b""
        for log in sorted(self.folder.glob("a*.lcm")):
            rows, words = self.info(log)
            self.assertNotIn("the log is damaged", words)
            seen += int(rows["POSE"][2]) if "POSE" in rows else 0
            everything += log.read_bytes()
        self.assertGreaterEqual(seen, 200)
        self.assertLess(seen, 400)
        self.assertNotIn(b"0 not written", everything[-3000:])


if __name__ == "__main__":
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    subprocess.run(["ip", "link", "set", "lo", "multicast", "on"], check=True)
    subprocess.run(["ip", "route", "add", f"{GROUP}/32", "dev", "lo"], check=True)
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
