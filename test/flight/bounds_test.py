"""A whole flight within the bounds of bounds.json, not only without a collision: bounds_test.py BIN_DIR NAME

A bound is what the flight had when it was recorded, with room: twice an error (1 cm at least), twice a
count and two more, half of a distance, and a hundredth of a share. Nobody widens one to let a change pass."""

import json
import pathlib
import subprocess
import sys
import tempfile

FOLDER = pathlib.Path(__file__).resolve().parent
SCENARIOS = FOLDER.parents[1] / "deploy" / "scenarios"


def fly(bin_dir, flight):
    """The metrics of a flight; its criteria are for the caller to judge."""
    with tempfile.TemporaryDirectory() as folder:
        metrics = pathlib.Path(folder) / "metrics.json"
        command = [f"{bin_dir}/chase-flight", SCENARIOS / f"{flight['scenario']}.yaml", "--quiet", "--metrics",
                   metrics, *flight["options"]]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        if not metrics.exists():
            sys.exit(f"{' '.join(map(str, command))}: {run.stderr.strip()}")
        return json.loads(metrics.read_text(encoding="utf-8"))


def excesses(metrics, flight):
    """A line for each figure beyond its bound."""
    part = "--until" in flight["options"]
    lines = [f"criterion {name} failed" for name, kept in metrics["criteria"].items()
             if not kept and not (part and name == "complete")]
    for side, worse in (("at_most", lambda a, b: a > b), ("at_least", lambda a, b: a < b)):
        for name, bound in flight[side].items():
            if not isinstance(metrics[name], (int, float)) or worse(metrics[name], bound):
                lines.append(f"{name} is {metrics[name]}, bound {side.replace('_', ' ')} {bound}")
    return lines


def main(bin_dir, name):
    flight = json.loads((FOLDER / "bounds.json").read_text(encoding="utf-8"))[name]
    metrics = fly(bin_dir, flight)
    for bounds in (flight["at_most"], flight["at_least"]):
        for figure in bounds:
            print(f"{figure:<24} {metrics[figure]:.4g}")
    if lines := excesses(metrics, flight):
        sys.exit("\n".join(lines))


if __name__ == "__main__":
    main(*sys.argv[1:])
