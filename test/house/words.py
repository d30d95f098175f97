"""Looks for unfinished work, machine paths and generators that break repeatability."""

import re
import sys

import tree

RULES = [
    (r"\b(TO" r"DO|FIX" r"ME|X" r"XX)\b", "unfinished work", ()),
    (r"(?<![\w.])/(home|root|work|Users)/\w", "a path of one machine", ()),
    (r"\bEigen::\w+::Rand" r"om\b|::Rand" r"om\(|\bstd::rand\b|random_dev" r"ice", "a global generator", ()),
    (r"^\s*using namespace\b", "using namespace in a header", (".cpp",)),
]
SOURCES = ("*.h", "*.cpp", "*.py", "*.cmake", "*CMakeLists.txt", "*.lcm", "*.md", "*.yaml")
LONGEST = 400  # lines of a source file before it is worth a hard look


def check(path):
    lines = tree.text(path).splitlines()
    for number, line in enumerate(lines, 1):
        for pattern, what, exempt in RULES:
            if path.suffix not in exempt and re.search(pattern, line):
                yield f"{path}:{number}: {what}: {line.strip()[:80]}"
    if path.suffix in (".h", ".cpp") and len(lines) > LONGEST:
        print(f"note: {path}: {len(lines)} lines; is it still one idea?")


def main():
    return tree.report([problem for path in tree.files(*SOURCES) for problem in check(path)])


if __name__ == "__main__":
    sys.exit(main())
