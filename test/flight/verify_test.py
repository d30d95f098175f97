#!/usr/bin/env python3
"""chase-log verify proves every plan of a flight, and none whose obstacles were exchanged.

Usage: verify_test.py BIN_DIR FLIGHT.lcm
"""
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "replay"))
import lcmlog

BIN, FLIGHT = sys.argv[1:]
HEAD = 20  # bytes: fingerprint, utime, seq


def verify(log):
    result = subprocess.run([f"{BIN}/chase-log", "verify", log], capture_output=True, text=True, check=False)
    found = re.search(r"(\d+) of them certified: (\d+) proven, (\d+) refuted", result.stdout)
    if not found:
        sys.exit(f"verify said: {result.stdout}{result.stderr}")
    return result.returncode, *map(int, found.groups())


def exchanged(events):
    """Every list says what the one of a second before said, under its own time and number."""
    lists = [data for _, channel, data in events if channel == "OBSTACLES"]
    number = 0
    for utime, channel, data in events:
        if channel == "OBSTACLES":
            data, number = data[:HEAD] + lists[number - 10][HEAD:], number + 1
        yield utime, channel, data


code, certified, proven, refuted = verify(FLIGHT)
if code or certified < 20 or proven != certified:
    sys.exit(f"the flight: exit {code}, {proven} of {certified} proven")
with tempfile.TemporaryDirectory() as folder:
    lcmlog.write(f"{folder}/exchanged.lcm", exchanged(list(lcmlog.read(FLIGHT))))
    code, _, proven_then, refuted = verify(f"{folder}/exchanged.lcm")
if code != 1 or refuted < certified // 5:
    sys.exit(f"obstacles of another second: exit {code}, {refuted} refuted, {proven_then} proven")
print(f"{proven} of {certified} plans proven; with obstacles of another second {refuted} refuted")
