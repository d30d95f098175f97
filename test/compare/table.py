#!/usr/bin/env python3
"""Table of a campaign for a README: table.py OUT/flights.json prints Markdown.

Per scenario and planner: acceleration cost [m^2/s^4], mean processor time to plan [ms], and, in brackets, safe and
visible ratio where one is below 1."""

import json
import pathlib
import sys


def cell(flight):
    text = f"{flight['acceleration_cost']:.3f}, {flight['plan_cpu_ms']['mean']:.3f}"
    safe, visible = flight["safe_ratio"], flight["visible_ratio"]
    return text + (f" ({safe:.3f} {visible:.3f})" if min(safe, visible) < 1 else "")


def main():
    flights = json.loads(pathlib.Path(sys.argv[1]).read_text(encoding="ascii"))
    planners = list(dict.fromkeys(f["planner"] for f in flights))
    scenarios = list(dict.fromkeys(f["scenario"] for f in flights))
    at = {(f["scenario"], f["planner"]): f for f in flights}
    print("| | " + " | ".join(f"`{p}`" for p in planners) + " |")
    print("| --- " * (len(planners) + 1) + "|")
    for s in scenarios:
        print(f"| {s} | " + " | ".join(cell(at[s, p]) if (s, p) in at else "" for p in planners) + " |")
    for p in planners:
        ratios = [f["distance_ratio"] for f in flights if f["planner"] == p]
        print(f"{p}: distance ratio {min(ratios):.3f} to {max(ratios):.3f}", file=sys.stderr)


if __name__ == "__main__":
    main()
