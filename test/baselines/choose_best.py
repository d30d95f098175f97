#!/usr/bin/env python3
"""Best parameter set of each tuned rival per scenario: choose_best.py flights.json writes best.csv files.

flights.json comes from chase-compare --planners penin_style:all,naegeli_style:all. Best: largest mean of
safe and visible ratio, then the distance ratio nearest to 1, then the least acceleration cost. The best
over all scenarios, `overall`, is used for scenarios that are not listed."""

import json
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "deploy/launcher"))
sys.dont_write_bytecode = True
import script  # noqa: E402


def merit(flight):
    in_sight = (flight["safe_ratio"] + flight["visible_ratio"]) / 2
    return (-in_sight, abs(flight["distance_ratio"] - 1), flight["acceleration_cost"])


def mean_merit(flights):
    columns = list(zip(*map(merit, flights)))
    return tuple(sum(column) / len(column) for column in columns)


def read(arguments, home):
    """The flights of a flights.json; ends with one line where they are not those of parameter sets."""
    if len(arguments) != 1:
        sys.exit("choose_best.py: takes one file; usage: choose_best.py OUT/flights.json")
    try:
        flights = json.loads(pathlib.Path(arguments[0]).read_text(encoding="ascii"))
        for flight in flights:
            merit(flight), flight["scenario"], flight["parameter_set"] + 0
        strange = {f["planner"] for f in flights if not (home / f["planner"] / "sets.csv").is_file()}
    except OSError as error:
        sys.exit(f"choose_best.py: {arguments[0]}: {error.strerror}")
    except (ValueError, KeyError, TypeError):
        sys.exit(f"choose_best.py: {arguments[0]}: is no flights.json of chase-compare with parameter sets; "
                 "fly them with --planners penin_style:all,naegeli_style:all")
    if not flights:
        sys.exit(f"choose_best.py: {arguments[0]}: holds no flights")
    if strange:
        sys.exit(f"choose_best.py: {arguments[0]}: no parameter sets are known of {', '.join(sorted(strange))}")
    return flights


def main():
    home = pathlib.Path(__file__).resolve().parent
    flights = read(script.arguments(__doc__, 0), home)
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
