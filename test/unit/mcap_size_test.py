#!/usr/bin/env python3
"""A flight's MCAP file: every channel passes the check of Foxglove's loader, it is at most 0.8 times as large as the log, and 20 s of
processor time do for the gym's 1050 MB.

mcap_size_test.py BIN_DIR FLIGHT.lcm"""

import json
import pathlib
import resource
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test/replay"))
sys.path.append(str(ROOT / "deploy/launcher"))
sys.dont_write_bytecode = True
import lcmlog  # noqa: E402
import script  # noqa: E402

MOST_RATIO, MOST_SECONDS_PER_MB = 0.8, 20.0 / 1050.0


def main(bin_dir, log):
    modules = ROOT / "logs/node_modules"
    if not (modules / "@mcap/core").is_dir():
        print("skipped: npm ci --prefix logs brings the readers")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "flight.mcap"
        subprocess.run([f"{bin_dir}/chase-log", "export", "--mcap", log, out], check=True)
        seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime  # whatever else the machine does
        size = pathlib.Path(log).stat().st_size
        ratio = out.stat().st_size / size
        answer = subprocess.run(["node", ROOT / "test/unit/mcap_check.cjs", modules, out], check=True, capture_output=True, text=True)
    topics, counts = json.loads(answer.stdout), {}
    for _, channel, _ in lcmlog.read(log):
        counts[channel] = counts.get(channel, 0) + 1
    passed = sum(topics.get(channel, {}).get("count") == count for channel, count in counts.items())
    print(f"{passed} of {len(counts)} channels, {ratio:.2f} times the log, {seconds:.1f} s for {1e-6 * size:.0f} MB")
    return 0 if passed == len(counts) and ratio <= MOST_RATIO and seconds <= MOST_SECONDS_PER_MB * 1e-6 * size else 1


sys.exit(main(*script.arguments(__doc__, 2, 2)))
