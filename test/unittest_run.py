#!/usr/bin/env python3
"""Runs a script of unittests so that CTest is told of skipped tests too: exit code 77 where some were, and
none failed. A failure is never hidden by a skip.

unittest_run.py SCRIPT ARGUMENTS..."""

import pathlib
import runpy
import sys
import unittest

SKIPPED = 77
skipped = []


class Result(unittest.TextTestResult):
    def addSkip(self, test, reason):
        super().addSkip(test, reason)
        skipped.append(f"{test.id()}: {reason}")


def main():
    script = pathlib.Path(sys.argv[1]).resolve()
    sys.argv = sys.argv[1:]
    sys.path[0] = str(script.parent)
    unittest.TextTestRunner.resultclass = Result
    try:
        runpy.run_path(str(script), run_name="__main__")
    except SystemExit as end:
        if end.code not in (None, 0, False):
            raise
    for line in skipped:
        print(line)
    return SKIPPED if skipped else 0


if __name__ == "__main__":
    sys.exit(main())
