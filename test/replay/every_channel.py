#!/usr/bin/env python3
"""Adds to a log a message a second of every channel of the table, and of every process's status, that it lacks, and
prints those channels with their types: every_channel.py PYTHON_TYPES IN.lcm OUT.lcm"""

import json
import pathlib
import re
import sys

import lcmlog

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "deploy/launcher"))
sys.dont_write_bytecode = True
import script  # noqa: E402

ROW = re.compile(r'^ *\{"(\w+)", "(\w+_t)", "', re.MULTILINE)
ROOT = pathlib.Path(__file__).resolve().parents[2]
TABLE, PROCESSES = ROOT / "common/bus/channels.cpp", ROOT / "deploy/processes.json"


def channels():
    """{channel: (type, name of the process where it is a status)}."""
    rows = json.loads(PROCESSES.read_text(encoding="utf-8"))["processes"]
    return {**{channel: (kind, None) for channel, kind in ROW.findall(TABLE.read_text(encoding="utf-8"))},
            **{f"{row['name'].upper()}_STATUS": ("status_t", row["name"]) for row in rows}}


def filled(kind, utime, process):
    message = kind()
    message.utime = utime
    for name, value in {"corners": [0.0, 0.0, 9.0, 0.0, 9.0, 9.0], "n_corners": 6, "ceiling": 5.0,
                        "missing": ["a battery"], "n_missing": 1, "name": process or "lidar_gap"}.items():
        if hasattr(message, name):
            setattr(message, name, value)
    return message.encode()


def added(types, events):
    """`events` with what they lack; {channel: type} of that. `types`: the package that lcm-gen writes."""
    there = {channel for _, channel, _ in events}
    lacking = {channel: row for channel, row in channels().items() if channel not in there}
    first, last = events[0][0], events[-1][0]
    more = [(utime, channel, filled(getattr(types, kind), utime, process))
            for utime in range(first, last, 1_000_000) for channel, (kind, process) in lacking.items()]
    return sorted(events + more, key=lambda event: event[0]), {channel: kind for channel, (kind, _) in lacking.items()}


def main(types, log, out):
    sys.path.insert(0, types)
    import chase  # noqa: PLC0415
    events, lacking = added(chase, list(lcmlog.read(log)))
    lcmlog.write(out, events)
    for channel, kind in lacking.items():
        print(channel, kind)


if __name__ == "__main__":
    main(*script.arguments(__doc__, 3, 3))
