"""Whole flights within the bounds of bounds.json, not only without a collision: bounds_test.py BIN_DIR NAME

A bound is on each of its seeds, and has room over the worst when it was recorded: twice an error (1 cm at least), half of
a distance, a hundredth of a share. The share of plans that are fallbacks is of all seeds together, and has room for three
deviations of such a mean over that of many flights. Nobody widens one to let a change pass."""

import json
import pathlib
import subprocess
import sys
import tempfile

FOLDER = pathlib.Path(__file__).resolve().parent
SCENARIOS = FOLDER.parents[1] / "deploy" / "scenarios"


def fly(bin_dir, flight, seed):
    """The metrics of a flight; its criteria are for the caller to judge."""
    with tempfile.TemporaryDirectory() as folder:
        metrics = pathlib.Path(folder) / "metrics.json"
        command = [f"{bin_dir}/chase-flight", SCENARIOS / f"{flight['scenario']}.yaml", "--seed", str(seed), "--quiet",
                   "--metrics", metrics, *flight["options"]]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        if not metrics.exists():
            sys.exit(f"{' '.join(map(str, command))}: {run.stderr.strip()}")
        return json.loads(metrics.read_text(encoding="utf-8"))


def failed_criteria(metrics, flight):
    part = "--until" in flight["options"]
    return [f"seed {metrics['seed']}: criterion {name} failed" for name, kept in metrics["criteria"].items()
            if not kept and not (part and name == "complete")]


def excesses(flights, flight):
    """A line for each figure of a flight beyond its bound; prints the figures."""
    lines = []
    for side, sign in (("at_most", 1), ("at_least", -1)):
        for name, bound in flight[side].items():
            words = f"bound {side.replace('_', ' ')} {bound}"
            print(f"{name:<24} {[m[name] for m in flights]}, {words}")
            lines += [f"seed {m['seed']}: {name} is {m[name]}, {words}" for m in flights
                      if not isinstance(m[name], (int, float)) or not sign * m[name] <= sign * bound]
    return lines


def main(bin_dir, name):
    flight = json.loads((FOLDER / "bounds.json").read_text(encoding="utf-8"))[name]
    flights = [fly(bin_dir, flight, seed) for seed in flight["seeds"]]
    lines = [line for metrics in flights for line in failed_criteria(metrics, flight)]
    share = sum(m["fallbacks"] for m in flights) / sum(m["replans"] for m in flights)
    for metrics in flights:
        metrics["fallback_share"] = share
    if lines := lines + excesses(flights, flight):
        sys.exit("\n".join(lines))


if __name__ == "__main__":
    main(*sys.argv[1:])
