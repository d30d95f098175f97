"""The safety lines of lines.txt, the hazards of SAFETY.md, and what is wrong with either.

A block of lines.txt is `key: value` a line and ends at an empty one: hazard (first cell of a row of
SAFETY.md), file, text (found once in the file, or taken where it first follows the line `after`),
by (what it is replaced by; empty: taken out) and test (name, and a GoogleTest's case)."""

import collections
import dataclasses
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "house"))
import tree  # noqa: E402, pylint: disable=wrong-import-position

ROOT = tree.ROOT
SAFETY = pathlib.Path("services/planning/SAFETY.md")
LINES, EQUIVALENT = HERE / "lines.txt", HERE / "equivalent.txt"
SHORT = re.compile(r"`([\w./]+\.(?:cpp|h))`((?: `\w+`,?)*)")  # a file and what it is to hold


@dataclasses.dataclass(frozen=True)
class Line:
    hazard: str
    file: str
    text: str
    by: str
    test: str
    after: str = ""

    def changed(self, source):
        """The source with the line changed; nothing where the line is not found, or more than once."""
        start = source.find(self.after) if self.after else 0
        count = source.count(self.after if self.after else self.text)
        if count != 1 or source.find(self.text, start) < 0:
            return None
        return source[:start] + source[start:].replace(self.text, self.by, 1)

    @property
    def program(self):
        return self.test.split()[0]

    @property
    def case(self):
        return self.test.partition(" ")[2]


def blocks(path):
    """The blocks of a file as dictionaries; lines that begin with # are comments."""
    text = "\n".join(x for x in path.read_text(encoding="utf-8").splitlines() if x[:1] != "#")
    for block in filter(None, re.split(r"\n\s*\n", text.strip())):
        pairs = (line.partition(":") for line in block.splitlines())
        yield {key.strip(): value.strip() for key, _, value in pairs}


def lines():
    return [Line(**block) for block in blocks(LINES)]


def hazards():
    """Rows of SAFETY.md's table of hazards: {hazard: (cell of lines, cell of tests)}."""
    rows = {}
    for row in tree.text(SAFETY).partition("## Hazards")[2].splitlines():
        cells = [cell.strip() for cell in row.strip("| ").split(" | ")]
        if row.startswith("|") and len(cells) == 4 and not cells[0].startswith(("hazard", "---")):
            rows[cells[0]] = (cells[2], cells[3])
    return rows


def path_of(name):
    """Files without a folder are of this one."""
    return pathlib.Path(name) if "/" in name else SAFETY.parent / name


def in_documents():
    """Files and names of the case that do not exist."""
    for hazard, (where, tests) in hazards().items():
        found = SHORT.findall(where)
        if not found or not tests:
            yield f"{SAFETY}: '{hazard}' names no file or no test"
        for name, words in found:
            path = path_of(name)
            if not (ROOT / path).is_file():
                yield f"{SAFETY}: {path} does not exist"
                continue
            for word in re.findall(r"\w+", words):
                if not re.search(rf"\b{word}\b", tree.text(path)):
                    yield f"{SAFETY}: {path} holds no {word}"


def in_line(line, rows, cases):
    """What is wrong with one line of lines.txt."""
    if line.hazard not in rows:
        yield f"{SAFETY} has no hazard '{line.hazard}'"
        return
    where, tests = rows[line.hazard]
    if pathlib.Path(line.file) not in [path_of(name) for name, _ in SHORT.findall(where)]:
        yield f"'{line.hazard}': {SAFETY} does not name {line.file}"
    if f"`{line.program}`" not in tests:
        yield f"'{line.hazard}': {SAFETY} does not name {line.program}"
    path = ROOT / line.file
    if not path.is_file() or line.changed(path.read_text(encoding="utf-8")) is None:
        yield f"'{line.hazard}': {line.file} does not hold, or not once: {line.text}"
    if line.case and line.case not in cases:
        yield f"'{line.hazard}': there is no test {line.case}"


def all_cases():
    pattern = re.compile(r"^TEST(?:_F|_P)?\((\w+),\s*(\w+)\)", re.MULTILINE)
    return {f"{a}.{b}" for path in tree.files("test/unit/*.cpp")
            for a, b in pattern.findall(tree.text(path))}


def problems(registered, table):
    """Where SAFETY.md, `table`, the sources and the tests (names) do not agree."""
    rows, cases = hazards(), all_cases()
    found = list(in_documents())
    for line in table:
        found += in_line(line, rows, cases)
        if line.program not in registered:
            found.append(f"'{line.hazard}': {line.program} is not registered with CTest")
    found += [f"{EQUIVALENT.name}: {block['file']} does not hold: {block['line']}"
              for block in blocks(EQUIVALENT)
              if block["line"] not in tree.text(pathlib.Path(block["file"]))]
    counts = collections.Counter((b["file"], b["line"], b["is"]) for b in blocks(EQUIVALENT))
    found += [f"{EQUIVALENT.name} says more than once what {file} may hold instead of: {text}"
              for (file, text, _), count in counts.items() if count > 1]
    return found


def unguarded(table):
    """Hazards with fewer lines for a file than SAFETY.md names functions of it."""
    held = collections.Counter((line.hazard, pathlib.Path(line.file)) for line in table)
    for hazard, (where, _) in hazards().items():
        for name, words in SHORT.findall(where):
            least, path = max(1, len(re.findall(r"\w+", words))), path_of(name)
            if held[hazard, path] < least:
                yield (f"{LINES.name} has {held[hazard, path]} of {least} lines for"
                       f" '{hazard}', {path}")
