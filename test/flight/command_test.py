#!/usr/bin/env python3
"""chase-command against a live chase-mission that has nothing to fly with: exit codes and words.

command_test.py BIN_DIR, in a network namespace of its own."""

import pathlib
import subprocess
import sys
import time
import unittest

BIN = pathlib.Path(sys.argv[1])


def command(*words):
    return subprocess.run([BIN / "chase-command", *words], capture_output=True, text=True,
                          timeout=20, check=False)


class Command(unittest.TestCase):
    def assert_said(self, answer, code, *words):
        self.assertEqual((answer.returncode, answer.stdout), (code, ""), answer.stderr)
        self.assertEqual(answer.stderr.count("\n"), 1, answer.stderr)
        for word in words:
            self.assertIn(word, answer.stderr)

    def test_refusals_and_silence(self):
        self.assert_said(command("stop"), 3, "no answer", "chase-mission")
        self.assert_said(command("select", "1", "2"), 3, "no answer", "chase-perception")
        mission = subprocess.Popen([BIN / "chase-mission", "--channel-prefix", "falcon_"])
        try:
            time.sleep(0.5)
            self.assert_said(command("takeoff", "--vehicle", "falcon_"), 2, "takeoff in IDLE",
                             "POSE is not heard", "planning is not heard")
            self.assert_said(command("chase", "--vehicle", "falcon_", "--wait"), 2, "chase in IDLE")
            self.assert_said(command("stop", "--vehicle", "eagle_"), 3, "no answer", "eagle_")
            self.assert_said(command("kill", "--vehicle", "falcon_"), 2, "--force", "it falls")
            killed = command("kill", "--force", "--vehicle", "falcon_")
            self.assertEqual((killed.returncode, killed.stdout), (0, "DONE: killed: motors cut by command\n"))
            self.assert_said(command("takeoff", "--vehicle", "falcon_"), 2, "motors are off")
        finally:
            mission.terminate()
            mission.wait(timeout=10)

    def test_a_command_from_before_the_start_may_have_taken_effect(self):
        given = subprocess.Popen([BIN / "chase-command", "chase"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        time.sleep(0.5)
        mission = subprocess.Popen([BIN / "chase-mission"])
        try:
            out, err = given.communicate(timeout=20)
            self.assertEqual((given.returncode, out), (5, ""), err)
            self.assertIn("chase: not known whether it took effect: given before the mission process started, now IDLE: ", err)
            self.assertNotIn("refused", err)
        finally:
            mission.terminate()
            mission.wait(timeout=10)

    def test_bad_use(self):
        for words in ((), ("fly",), ("stop", "now"), ("land", "--force"), ("stop", "--timeout", "nan"),
                      ("stop", "--timeout", "0"), ("stop", "--lcm-url", "udpm://nonsense"), ("select",),
                      ("select", "5"), ("select", "a", "b"), ("select", "1", "2", "3"), ("hold", "1", "2"),
                      ("select", "1", "2", "--wait")):
            self.assert_said(command(*words), 1, "chase-command: ")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
