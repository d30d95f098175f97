"""Checks the READMEs: every folder has one, it fits a screen, and what it names exists.

The commands of the top README are also run, except the two that this test suite is part of or that
the live flight test runs."""

import pathlib
import re
import subprocess
import sys

import tree

ONE_SCREEN = 60  # lines
FOLDERS = ("common", "common/*", "deploy", "deploy/*", "lcmtypes", "logs", "services/*", "test",
           "test/house")
BLOCK = re.compile(r"^```\w*\n(.*?)^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)#]+)[^)]*\)")
RUN_ELSEWHERE = ("deploy/fly", "test/run")
LIMIT = 120  # s for one command


def commands(path):
    """The lines of fenced blocks that call something of ours."""
    for block in BLOCK.findall(tree.text(path)):
        for line in block.splitlines():
            line = re.sub(r"^\$ ", "", line.strip())
            if re.match(r"(build/bin|build/test|deploy|test)/", line):
                yield re.sub(r"\s+#.*$", "", line)


def missing_program(command, bin_dir):
    """The command's program when it does not exist, else None."""
    word = command.split()[0]
    if "$" in word:
        return None
    path = tree.ROOT / word
    if word.startswith("build/"):
        path = bin_dir.parent / word.split("/", 1)[1]
    return None if path.exists() else word


def check_readme(path, bin_dir):
    for command in commands(path):
        if word := missing_program(command, bin_dir):
            yield f"{path}: names {word}, which does not exist"
    for target in LINK.findall(tree.text(path)):
        if "://" not in target and not (tree.ROOT / path.parent / target).exists():
            yield f"{path}: links to {target}, which does not exist"
    lines = len(tree.text(path).splitlines())
    if path != pathlib.Path("README.md") and lines > ONE_SCREEN:
        yield f"{path}: {lines} lines, more than a screen"


def check_folders():
    tracked = {str(p) for path in tree.files() for p in path.parents}
    for pattern in FOLDERS:
        for folder in sorted(tree.ROOT.glob(pattern)):
            name = str(folder.relative_to(tree.ROOT))
            if name in tracked and not (folder / "README.md").is_file():
                yield f"{name}: has no README.md"


def run(command, bin_dir):
    """What went wrong when the command was run, or nothing."""
    line = command.replace("build/", f"{bin_dir.parent}/")
    answer = subprocess.run(line, shell=True, cwd=tree.ROOT, capture_output=True, text=True,
                            timeout=LIMIT, check=False)
    if answer.returncode:
        yield f"README.md: '{command}' exits {answer.returncode}: {answer.stderr.strip()[-300:]}"


def main():
    bin_dir = pathlib.Path(sys.argv[1]).resolve()
    problems = list(check_folders())
    for path in tree.files("*README.md"):
        problems += check_readme(path, bin_dir)
    top = list(commands("README.md"))
    problems += [f"README.md: does not name {c}" for c in RUN_ELSEWHERE
                 if not any(line.startswith(c) for line in top)]
    for command in top:
        if not command.startswith(RUN_ELSEWHERE) and not missing_program(command, bin_dir):
            problems += run(command, bin_dir)
    return tree.report(problems)


if __name__ == "__main__":
    sys.exit(main())
