#!/usr/bin/env python3
"""Best parameter set of each tuned rival per scenario: choose_best.py flights.json writes best.csv files.

flights.json comes from chase-compare --planners penin_style:all,naegeli_style:all. Best: largest mean of
safe and visible ratio, then the distance ratio nearest to 1, then the least acceleration cost. The best
over all scenarios, `overall`, is used for scenarios that are not listed."""

import json
import pathlib
import sys


def merit(flight):
    in_sight = (flight["safe_ratio"] + flight["visible_ratio"]) / 2
    return (-in_sight, abs(flight["distance_ratio"] - 1), flight["acceleration_cost"])


def mean_merit(flights):
    columns = list(zip(*map(merit, flights)))
    return tuple(sum(column) / len(column) for column in columns)


def main():
    flights = json.loads(pathlib.Path(sys.argv[1]).read_text(encoding="ascii"))
    home = pathlib.Path(__file__).resolve().parent
    for planner in sorted({f["planner"] for f in flights}):
        mine = [f for f in flights if f["planner"] == planner]
        scenarios = list(dict.fromkeys(f["scenario"] for f in mine))
        sets = sorted({f["parameter_set"] for f in mine})
        lines = ["scenario,set"]
        for s in scenarios:
            best = min((f for f in mine if f["scenario"] == s), key=merit)
            lines.append(f"{s},{best['parameter_set']}")
        overall = min(sets, key=lambda n: mean_merit([f for f in mine if f["parameter_set"] == n]))
        lines.append(f"overall,{overall}")
        (home / planner / "best.csv").write_text("\n".join(lines) + "\n", encoding="ascii")


if __name__ == "__main__":
    main()
