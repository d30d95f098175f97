#!/usr/bin/env python3
"""Replays one service twice from a recorded flight: the bytes must repeat, and what the service sent in
the flight must come out again, message by message.

Usage: replay_check.py BIN_DIR SERVICE SCENARIO FLIGHT.lcm CHANNEL...
"""
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).parent))
sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "deploy/launcher"))
sys.dont_write_bytecode = True
import lcmlog  # noqa: E402
import script  # noqa: E402


def replay(program, config, flight, out):
    subprocess.run([program, "--config", config, "--replay", flight, "--out", out], check=True)
    return pathlib.Path(out).read_bytes()


def main(bin_dir, service, scenario, flight, *channels):
    with tempfile.TemporaryDirectory() as folder:
        config = f"{folder}/config.yaml"
        text = subprocess.run([f"{bin_dir}/chase-flight", scenario, "--print-config", service],
                              check=True, capture_output=True, text=True).stdout
        pathlib.Path(config).write_text(text)
        program = f"{bin_dir}/chase-{service}"
        first = replay(program, config, flight, f"{folder}/a.lcm")
        second = replay(program, config, flight, f"{folder}/b.lcm")
        if first != second:
            sys.exit(f"{service}: two replays differ")
        replayed = {c: [] for c in channels}
        for _, channel, data in lcmlog.read(f"{folder}/a.lcm"):
            replayed.setdefault(channel, []).append(data)
    recorded = {c: [] for c in channels}
    for _, channel, data in lcmlog.read(flight):
        if channel in recorded:
            recorded[channel].append(data)
    for channel in channels:
        compare(service, channel, recorded[channel], replayed[channel])
    print(f"{service}: repeats, and equals the flight on {', '.join(channels)}")


def compare(service, channel, recorded, replayed):
    """The flight ends before the last outputs are delivered, so it may hold a few messages less."""
    if not recorded:
        sys.exit(f"{service}: the flight holds no {channel}")
    if not 0 <= len(replayed) - len(recorded) <= 40:
        sys.exit(f"{service}: {len(replayed)} {channel} replayed, {len(recorded)} in the flight")
    for i, (a, b) in enumerate(zip(recorded, replayed)):
        if a != b:
            sys.exit(f"{service}: {channel} number {i} differs from the flight")


main(*script.arguments(__doc__, 5))
