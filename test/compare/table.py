#!/usr/bin/env python3
"""Table of a campaign for a README: table.py OUT/flights.json prints Markdown.

Per scenario and planner: acceleration cost [m^2/s^4], mean processor time to plan [ms], and, in brackets, safe and
visible ratio where one is below 1."""

import json
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "deploy/launcher"))
sys.dont_write_bytecode = True
import script  # noqa: E402


def cell(flight):
    text = f"{flight['acceleration_cost']:.3f}, {flight['plan_cpu_ms']['mean']:.3f}"
    safe, visible = flight["safe_ratio"], flight["visible_ratio"]
    return text + (f" ({safe:.3f} {visible:.3f})" if min(safe, visible) < 1 else "")


def read(arguments):
    """The flights of a flights.json; ends with one line where it is none."""
    if len(arguments) != 1:
        sys.exit("table.py: takes one file; usage: table.py OUT/flights.json")
    try:
        flights = json.loads(pathlib.Path(arguments[0]).read_text(encoding="ascii"))
        for flight in flights:
            cell(flight), flight["planner"], flight["scenario"], flight["distance_ratio"] + 0.0
    except OSError as error:
        sys.exit(f"table.py: {arguments[0]}: {error.strerror}; chase-compare --out OUT makes OUT/flights.json")
    except (ValueError, KeyError, TypeError):
        sys.exit(f"table.py: {arguments[0]}: is no flights.json of chase-compare")
    if not flights:
        sys.exit(f"table.py: {arguments[0]}: holds no flights")
    return flights


def main():
    flights = read(script.arguments(__doc__, 0))
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
