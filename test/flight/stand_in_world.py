#!/usr/bin/env -S python3 -I -S
"""A stand-in for chase-world in tests of chase-campaign; seed 19 has no world."""

import pathlib
import sys

kind, seed, out = sys.argv[1], *(sys.argv[sys.argv.index(key) + 1] for key in ("--seed", "--out"))
if seed == "19":
    sys.exit("chase-world: no way through; cure: another seed")
duration = sys.argv[sys.argv.index("--duration") + 1] if "--duration" in sys.argv else "60"
pathlib.Path(out).write_text(f"# {kind} {seed} {duration}\n", encoding="ascii")
