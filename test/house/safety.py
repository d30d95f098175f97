"""Checks that the safety case, the lines that test/safety/run takes out and the tests agree: files,
names and texts exist, tests are registered with CTest (build folder: the argument)."""

import pathlib
import re
import sys

import tree

sys.path.insert(0, str(tree.ROOT / "test" / "safety"))
import table  # noqa: E402, pylint: disable=wrong-import-position

LEAST = 140  # lines


def registered(build):
    files = build.rglob("CTestTestfile.cmake")
    return {name for path in files
            for name in re.findall(r"^add_test\(\[?=*\[?(\w+)", path.read_text(encoding="utf-8"),
                                   re.MULTILINE)}


def main():
    lines = table.lines()
    found = table.problems(registered(pathlib.Path(sys.argv[1])), lines)
    found += table.unguarded(lines)
    if len(lines) < LEAST:
        found.append(f"{table.LINES.name} holds {len(lines)} lines; there were {LEAST}")
    return tree.report(found)


if __name__ == "__main__":
    sys.exit(main())
