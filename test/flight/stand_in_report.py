#!/usr/bin/env -S python3 -I -S
"""A stand-in for chase-report in tests of chase-campaign: the page is the log's text."""

import pathlib
import sys

log, _, out = sys.argv[1:]
if "seed 12" in pathlib.Path(log).read_text(encoding="ascii"):
    sys.exit("chase-report: no page today")
pathlib.Path(out).mkdir()
(pathlib.Path(out) / "report.html").write_text(pathlib.Path(log).read_text(encoding="ascii"), encoding="ascii")
sys.exit(2)  # what a flight that was ended early gets
