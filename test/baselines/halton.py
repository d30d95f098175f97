#!/usr/bin/env python3
"""The 20 parameter sets of the two optimising rivals: halton.py writes their sets.csv.

Halton points 1 to 20 in bases 2, 3, 5, 7, logarithmic over the ranges below."""

import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "deploy/launcher"))
sys.dont_write_bytecode = True
import script  # noqa: E402

RANGES = {
    "naegeli_style": [("distance", 0.1, 10), ("sight", 0.3, 100), ("potential", 0.01, 10),
                      ("effort", 0.003, 0.3)],
    "penin_style": [("distance", 0.1, 30), ("smooth", 1e-3, 1), ("image", 0.01, 3),
                    ("margin", 0.02, 0.4)],
}


def halton(index, base):
    value, part = 0.0, 1.0
    while index > 0:
        part /= base
        value += part * (index % base)
        index //= base
    return value


def main():
    for name, ranges in RANGES.items():
        lines = ["set," + ",".join(r[0] for r in ranges)]
        for i in range(1, 21):
            values = [low * (high / low) ** halton(i, base)
                      for (_, low, high), base in zip(ranges, (2, 3, 5, 7))]
            lines.append(f"{i}," + ",".join(f"{v:.6g}" for v in values))
        file = pathlib.Path(__file__).resolve().parent / name / "sets.csv"
        file.write_text("\n".join(lines) + "\n", encoding="ascii")


if __name__ == "__main__":
    script.arguments(__doc__, 0, 0)
    main()
