#!/usr/bin/env python3
"""Flies the gym live, alone and with onlookers at the viewer, and says what they cost.

live_flights.py alone page chromium hostile --seed 1
live_flights.py alone alone alone alone alone      (do logs lose messages?)

alone: nobody looks; page: a scripted page that wants everything; chromium: the page itself, its processor time on the same machine;
hostile: thousands of connections, garbage, readers that read nothing, commands with wrong tokens. Each flight, the n-th with seed
--seed + n of its kind, takes 90 s on a machine that does nothing else. Exit 1 when a flight fails its criteria, lost a message or had a
process started anew, the viewer takes more than 15 % of a core or was made to command, or an onlooker saw too little. With --judge, for such a machine,
also when a flight's real-time factor is not 1.00, or planning took half as long again as in the first flight alone (99th percentile), or the page shows less than 30 frames a second while it plays the last flight.
"""

import argparse
import json
import pathlib
import re
import secrets
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path += [str(ROOT / "test/replay"), str(ROOT / "deploy/launcher")]
sys.dont_write_bytecode = True
import lcmlog  # noqa: E402
import version  # noqa: E402

VIEWER_SHARE = 0.15  # of a core
REAL_TIME = 0.995  # factor: 1.00 as it is shown
SLOWER = 1.5  # times as long as alone
MODULES = ROOT / "services/viewer/node_modules"
KINDS = ("alone", "page", "chromium", "hostile")


def onlooker(kind, port):
    return subprocess.Popen(["nice", "-n", "10", "node", ROOT / "test/viewer/onlooker.mjs", "none", "none",
                             MODULES, port, kind], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def fly(kind, scenario, seed):
    """Flies in a network namespace of its own; (exit code, folder of the flight, what the onlooker saw)."""
    with tempfile.NamedTemporaryFile("w", prefix="token-") as token:  # there is something to guess
        token.write(secrets.token_hex(16))
        token.flush()
        view = ["--view", "--token-file", token.name] if kind != "alone" else []
        return look_on(kind, [ROOT / "deploy/fly", scenario, "--seed", str(seed), *view])


def look_on(kind, command):
    flight = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    folder, looking = None, None
    for line in flight.stdout:
        print("  " + line, end="", flush=True)
        if match := re.search(r"into (\S+)$", line):
            folder = pathlib.Path(match.group(1))
        if match := re.search(r"look on at \S+:(\d+)", line):
            looking = onlooker(kind, match.group(1))
        if line.startswith("criterion") and looking:  # the flight is over
            looking.stdin.close()
    code = flight.wait()
    if not looking:
        return code, folder, {}
    text = looking.stdout.read()
    return code or looking.wait(), folder, json.loads(text) if text else {"failed": True}


def commands_of_viewer(log):
    return sum(b"viewer\0" in data[:64] for _, channel, data in lcmlog.read(log) if channel == "COMMAND")


def row_of(kind, scenario, seed):
    code, folder, seen = fly(kind, scenario, seed)
    metrics = json.loads((folder / "metrics.json").read_text()) if folder and (folder / "metrics.json").exists() else {}
    cpu = metrics.get("cpu_s", {})
    row = {"kind": kind, "seed": seed, "passed": code == 0 and metrics.get("passed", False),
           "real_time_factor": metrics.get("real_time_factor"), "plan_p99_ms": (metrics.get("plan_ms") or {}).get("p99"),
           "restarts": metrics.get("restarts", {}), "log": str(folder and folder / "flight.lcm"), "lost": sum(metrics.get("lost_messages", {}).values()),
           "onboard_cpu_s": round(sum(cpu.values()) - cpu.get("viewer", 0), 1)}
    if kind != "alone":
        row.update(viewer_share=round(cpu.get("viewer", 0) / metrics["flown_s"], 3) if metrics else None, seen=seen,
                   commands=commands_of_viewer(folder / "flight.lcm"))
    return row


def plays_smoothly(log):
    test = ["node", ROOT / "test/viewer/page_test.mjs", ROOT / "build/bin", log, MODULES, "--judge"]
    return subprocess.run(test, check=False).returncode == 0


def is_good(row, judge, alone):
    cheap = row["kind"] in ("alone", "hostile") or (row["viewer_share"] or 0) <= VIEWER_SHARE
    slow = alone and alone["plan_p99_ms"] and (row["plan_p99_ms"] or 0) > SLOWER * alone["plan_p99_ms"]
    return row["passed"] and row["lost"] == 0 and not row["restarts"] and cheap and row.get("commands", 0) == 0 \
        and (not judge or ((row["real_time_factor"] or 0) >= REAL_TIME and not slow))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--version", action="version", version=version.text())
    parser.add_argument("kinds", nargs="+", choices=KINDS)
    parser.add_argument("--scenario", default="gym")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--judge", action="store_true", help="the real-time factor and the page's frames a second, too")
    options = parser.parse_args()
    rows, flown = [], {}
    for kind in options.kinds:
        seed = options.seed + flown.get(kind, 0)
        flown[kind] = flown.get(kind, 0) + 1
        rows.append(row_of(kind, options.scenario, seed))
        print(json.dumps(rows[-1]), flush=True)
    alone = next((row for row in rows if row["kind"] == "alone"), None)
    print("\n" + "\n".join(json.dumps({**row, "good": is_good(row, options.judge, alone)}) for row in rows))
    good = all(is_good(row, options.judge, alone) for row in rows) and (not options.judge or plays_smoothly(rows[-1]["log"]))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
