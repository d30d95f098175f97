"""Random small changes of sources, put to the unit tests of planning and control."""

import math
import random
import re

import table
import workshop

# Sources, and the tests of planning and control that are quick, the quickest first.
PLANNING = tuple(f"services/planning/{name}.cpp" for name in
                 ("ladder", "pilot", "pilot_acts", "limits", "margins", "problem", "resting",
                  "separations", "stopping", "tube"))
PLANNING_TESTS = ("planning_test", "planning_node_test", "planning_minkowski_test",
                  "control_plan_check_test", "planning_refinement_test", "planning_search_test")
CONTROL = ("services/control/plan_follower.cpp", "common/world/plan_check.cpp")
CONTROL_TESTS = ("control_test", "control_node_test", "control_plan_check_test")
Z = 1.959964  # of 95 %

NUMBER = re.compile(r"(?<![\w.])(\d+\.\d*(?:e-?\d+)?)(?![\w.])")
COMPARE = {" < ": " > ", " > ": " < ", " <= ": " > ", " >= ": " < ", " == ": " != ", " != ": " == "}
SIGNS = {" + ": " - ", " - ": " + ", " += ": " -= ", " -= ": " += "}
EXTREMES = {"std::min(": "std::max(", "std::max(": "std::min(", ".minCoeff()": ".maxCoeff()",
            ".maxCoeff()": ".minCoeff()", ".min(": ".max(", ".max(": ".min("}
CONDITION = re.compile(r"\b(?:if|while) \(")
STATEMENT = re.compile(r"^\s+(?:[*\w.\[\]()>:-]+ (?:[-+*/|&]?=) .*|[\w.>:-]+\(.*\)|\w+\+\+|\+\+\w+|"
                       r"break|continue);$")
FUNCTION = re.compile(r"^ {0,2}(?:static )?(bool|void|std::optional<.*?>|std::string) [\w:]+\(")
ANSWERS = {"bool": ("true", "false"), "void": ("",), "std::string": ('""',)}


def masked(text):
    """The text with comments and what is quoted blanked out, of the same length."""
    pattern = r"//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"|^#[^\n]*"
    return re.sub(pattern, lambda m: re.sub(r"[^\n]", " ", m[0]), text,
                  flags=re.DOTALL | re.MULTILINE)


def replacements(code, words):
    for old, new in words.items():
        for match in re.finditer(re.escape(old), code):
            yield match.start(), match.end(), new


def conditions(code):
    for match in CONDITION.finditer(code):
        start = end = match.end()
        depth = 1
        while depth:
            depth += {"(": 1, ")": -1}.get(code[end], 0)
            end += 1
        inner = code[start:end - 1]
        if ";" not in inner and "auto " not in inner:
            yield start, end - 1, f"!({inner})"


def numbers(code):
    for match in NUMBER.finditer(code):
        value = float(match[1])
        for new in (0.5 * value, 2.0 * value) if value else (0.5,):
            yield match.start(), match.end(), repr(new)


def statements(code):
    """Whole lines that do something and stand for themselves; not what they declare or return."""
    start, before = 0, "{"
    for line in code.splitlines(keepends=True):
        text = line.rstrip()
        opens = before.endswith((";", "{", "}", ":")) or re.match(r"\s*(if|for|else|while)\b", before)
        if opens and STATEMENT.match(text) and "return" not in text:
            indent = len(text) - len(text.lstrip())
            yield start + indent, start + len(text), ";"
        before = text or before
        start += len(line)


def answers(code):
    """Functions that answer, or end, at once."""
    start = 0
    for line in code.splitlines(keepends=True):
        kind = FUNCTION.match(line)
        if kind:
            brace = code.find("{\n", start)
            end = code.find(";", start)
            if 0 <= brace < end:
                for answer in ANSWERS.get(kind[1], ("std::nullopt",)):
                    yield brace + 1, brace + 1, f" if (true) return {answer};"
        start += len(line)


OPERATORS = {
    "comparison": lambda code: replacements(code, COMPARE),
    "condition": conditions,
    "sign": lambda code: replacements(code, SIGNS),
    "extreme": lambda code: replacements(code, EXTREMES),
    "statement": statements,
    "constant": numbers,
    "answer": answers,
}


class Mutant:
    def __init__(self, file, text, start, end, new):
        self.file, self.text = file, text
        self.changed = text[:start] + new + text[end:]
        self.number = text.count("\n", 0, start) + 1

    def line(self, text):
        return text.splitlines()[self.number - 1].strip()

    def __str__(self):
        return (f"{self.file}:{self.number}\n  - {self.line(self.text)}\n"
                f"  + {self.line(self.changed)}")


def all_mutants(files):
    """{operator: its mutants} in a fixed order."""
    every = {name: [] for name in OPERATORS}
    for file in files:
        text = (table.ROOT / file).read_text(encoding="utf-8")
        code = masked(text)
        for name, operator in OPERATORS.items():
            every[name] += [Mutant(file, text, *change) for change in operator(code)]
    return every


def drawn(seed):
    """Mutants without end, or until there are no more: an operator, then a place."""
    generator = random.Random(seed)
    every = all_mutants(PLANNING + CONTROL)
    while any(every.values()):
        name = generator.choice(sorted(k for k in every if every[k]))
        yield every[name].pop(generator.randrange(len(every[name])))


def explained():
    return {(b["file"], b["line"], b["is"]): b["why"] for b in table.blocks(table.EQUIVALENT)}


def killer(shop, mutant):
    """The first test that fails; none where all pass. Raises Broken where it does not compile."""
    with shop.changed(mutant.file, lambda _: mutant.changed):
        for program in PLANNING_TESTS if mutant.file in PLANNING else CONTROL_TESTS:
            shop.make(program)
            if shop.fails(program):
                return program
    return None


def wilson(k, n):
    """95 % interval of a share of k in n."""
    share, z2 = k / n, Z * Z
    middle = (share + z2 / (2 * n)) / (1 + z2 / n)
    half = Z / (1 + z2 / n) * math.sqrt(share * (1 - share) / n + z2 / (4 * n * n))
    return middle - half, middle + half


def run(shop, count, seed, progress):
    """Draws until `count` mutants compile; the exit code."""
    shop.make(*PLANNING_TESTS, *CONTROL_TESTS)
    for program in {*PLANNING_TESTS, *CONTROL_TESTS}:
        if shop.fails(program):
            raise workshop.Broken(f"{program} fails before anything is changed")
    known, survivors, killed, tried = explained(), [], 0, 0
    for mutant in drawn(seed):
        if tried == count:
            break
        try:
            by = killer(shop, mutant)
        except workshop.Broken:
            continue
        tried += 1
        killed += by is not None
        progress(tried, count, f"{'killed by ' + by if by else 'SURVIVED'} {mutant}")
        if by is None:
            survivors.append(mutant)
    return report(tried, killed, survivors, known, seed)


def report(tried, killed, survivors, known, seed):
    if not tried:
        raise workshop.Broken("none of the random changes compiles")
    open_ones = 0
    for mutant in survivors:
        why = known.get((mutant.file, mutant.line(mutant.text), mutant.line(mutant.changed)))
        open_ones += why is None
        print(f"{mutant}\n  {'needs no test: ' + why if why else 'SURVIVED'}")
    low, high = wilson(killed, tried)
    print(f"seed {seed}: {killed} of {tried} random changes killed "
          f"({100 * killed / tried:.0f} %, 95 % Wilson {100 * low:.0f} to {100 * high:.0f} %); "
          f"of {len(survivors)} survivors {len(survivors) - open_ones} are explained")
    return 1 if open_ones else 0
