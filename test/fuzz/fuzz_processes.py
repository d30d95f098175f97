#!/usr/bin/env python3
"""The process table's reader: fuzz_processes.py CORPUS [--seconds S [--seed N]].

Reads every file of the corpus; with --seconds also mutations of them. A file is a table or refused
by one line, and nothing else."""

import argparse
import pathlib
import random
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "deploy" / "launcher"))

import processes  # noqa: E402
import version  # noqa: E402

WORDS = ["null", "true", "-1", "1e999", "NaN", '""', "[]", "{}", '"name"', '"\\ud800"', "[" * 2000, "9" * 5000]


def read(data):
    try:
        rows = processes.read_table(data, "fuzz")
    except processes.TableError as error:
        assert str(error).startswith("fuzz: ") and "\n" not in str(error), str(error)
        return
    assert rows and all(isinstance(row["name"], str) for row in rows)


def mutated(data, draw):
    data = bytearray(data)
    for _ in range(draw.randint(1, 4)):
        at = draw.randrange(len(data) + 1)
        kind = draw.randrange(4)
        if kind == 0:
            data[at:at + 1] = bytes([draw.randrange(256)])
        elif kind == 1:
            del data[at:at + draw.randint(1, 40)]
        elif kind == 2:
            data[at:at + draw.randrange(8)] = draw.choice(WORDS).encode()
        else:
            from_ = draw.randrange(len(data) + 1)
            data[at:at] = data[from_:from_ + draw.randint(1, 60)]
    return bytes(data)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--version", action="version", version=version.text())
    parser.add_argument("corpus", type=pathlib.Path)
    parser.add_argument("--seconds", type=float, default=0.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--artifacts", type=pathlib.Path, default=pathlib.Path("."))
    options = parser.parse_args()
    seeds = [path.read_bytes() for path in sorted(options.corpus.iterdir())]
    for data in seeds:
        read(data)
    draw, count, end = random.Random(options.seed), len(seeds), time.monotonic() + options.seconds
    while time.monotonic() < end:
        data = mutated(draw.choice(seeds), draw)
        try:
            read(data)
        except BaseException:
            (options.artifacts / "crash-processes").write_bytes(data)
            raise
        count += 1
    print(f"{count} inputs")
    return 0 if seeds else 1


if __name__ == "__main__":
    sys.exit(main())
