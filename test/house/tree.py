"""The files of the house: what git tracks, plus what it would track."""

import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]


def files(*patterns):
    """Paths relative to the root, sorted. Without git (a source archive): all files but builds'."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "--", *patterns]
    answer = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if answer.returncode == 0:
        found = (pathlib.Path(line) for line in answer.stdout.splitlines())
        return sorted({path for path in found if (ROOT / path).is_file()})
    found = (p.relative_to(ROOT) for pattern in patterns or ["*"] for p in ROOT.rglob(pattern))
    return sorted({path for path in found if (ROOT / path).is_file() and not generated(path)})


def generated(path):
    return path.parts[0].startswith("build") or "node_modules" in path.parts


def text(path):
    return (ROOT / path).read_text(encoding="utf-8", errors="replace")


def report(problems):
    """Prints the problems; the exit code."""
    for problem in problems:
        print(problem)
    print(f"{len(problems)} problems" if problems else "in order")
    return 1 if problems else 0
