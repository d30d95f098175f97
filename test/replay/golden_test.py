"""test/replay/golden.py with stand-ins for the programs: inputs are frozen, and no file is too large."""

import contextlib
import io
import pathlib
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import golden
import lcmlog

SERVICE = """#!/bin/sh
# What it hears, or something made of it; --config F --replay IN --out OUT.
python3 -c '
import sys; sys.path.insert(0, "{here}"); import lcmlog
lcmlog.write(sys.argv[6], [(t, "PLAN", {answer}) for t, _, d in lcmlog.read(sys.argv[4])])' "$@"
"""


class Golden(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        for name, value in (("GOLDEN", self.folder / "golden"),
                            ("SLICES", {"planning_x": (["POSE"], ["PLAN"], 1.0, 3.0, 1)})):
            self.addCleanup(setattr, golden, name, getattr(golden, name))
            setattr(golden, name, value)
        self.program("chase-flight", "#!/bin/sh\n")
        self.program("chase-log", "#!/bin/sh\ncmp $2 $3\n")
        self.service("d")
        self.flight("first", b"first")

    def program(self, name, text):
        path = self.folder / name
        path.write_text(text, encoding="utf-8")
        path.chmod(0o755)

    def service(self, answer):
        self.program("chase-planning", SERVICE.format(here=pathlib.Path(__file__).parent, answer=answer))

    def flight(self, name, data):
        lcmlog.write(str(self.folder / name), [(int(t * 1e6), "POSE", data) for t in (0.5, 1.5, 2.5, 3.5)])

    def run_it(self, command, *arguments):
        """What it refuses with, or nothing."""
        with contextlib.redirect_stdout(io.StringIO()):
            try:
                golden.main([command, str(self.folder), "gym.yaml", *arguments])
            except SystemExit as end:
                return str(end.code)
        return ""

    def held(self):
        with tempfile.TemporaryDirectory() as folder:
            return [[(t, d) for t, _, d in lcmlog.read(golden.unpack(f"planning_x.{side}.lcm", folder))]
                    for side in ("in", "out")]

    def test_new_golden_takes_its_slice_and_is_checked(self):
        self.assertEqual(self.run_it("record", str(self.folder / "first"), "planning_x"), "")
        slice_ = [(1500000, b"first"), (2500000, b"first")]
        self.assertEqual(self.held(), [slice_, slice_])
        self.assertEqual(self.run_it("check", "planning_x"), "")
        self.service("d[::-1]")
        self.assertIn("planning_x differs from its golden", self.run_it("check", "planning_x"))
        self.assertEqual(self.run_it("record", "frozen", "planning_x"), "")
        self.assertEqual(self.held(), [slice_, [(t, d[::-1]) for t, d in slice_]])
        self.assertEqual(self.run_it("check", "planning_x"), "")

    def test_a_channel_that_is_gone_is_a_difference(self):
        self.run_it("record", str(self.folder / "first"), "planning_x")
        self.program("chase-log", "#!/bin/sh\necho only in A: MAP\necho no difference\n")
        self.assertIn("only in A: MAP", self.run_it("check", "planning_x"))

    def test_input_is_frozen(self):
        self.run_it("record", str(self.folder / "first"), "planning_x")
        before = self.held()
        self.flight("second", b"second")
        self.assertIn("the input of planning_x is frozen", self.run_it("record", str(self.folder / "second"), "planning_x"))
        self.assertEqual(self.held(), before)

    def test_large_files_are_not_written(self):
        golden_largest, golden.LARGEST = golden.LARGEST, 10
        self.addCleanup(setattr, golden, "LARGEST", golden_largest)
        self.assertIn("more than is committed", self.run_it("record", str(self.folder / "first"), "planning_x"))
        self.assertEqual(list(golden.GOLDEN.iterdir()), [])

    def test_committed_files_are_small(self):
        folder = pathlib.Path(__file__).resolve().parents[2] / "logs" / "golden"
        self.assertEqual([p.name for p in folder.iterdir() if p.stat().st_size > golden.LARGEST], [])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
