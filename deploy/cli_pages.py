#!/usr/bin/env python3
"""Bash completion and man pages of every program, from what CLI11 prints for --help.

cli_pages.py BIN_DIR OUT [PROGRAM...] writes OUT/share/bash-completion/completions/chase-* and
OUT/share/man/man1/chase-*.1; of all programs there unless some are named."""

import pathlib
import re
import subprocess
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parent / "launcher"))
sys.dont_write_bytecode = True
import script  # noqa: E402

OPTION = re.compile(r"^\s+(-[-\w]*(?:,-[-\w]*)*)(?:\{\w+\})?( \S.*?)?(?:\s{2,}(\S.*))?$")
ENTRY = re.compile(r"^\s{2,4}(\S+)(?: (\S.*?))?(?:\s{2,}(\S.*))?$")
CHOICES = re.compile(r"\{([^}]*)\}")
NUMBER = re.compile(r"(U?INT|FLOAT)\b")
FILES = 'mapfile -t COMPREPLY < <(compgen -f -- "$now")'  # a name may hold blanks
EMPTY = {"options": [], "positionals": [], "subcommands": []}


def help_of(*command):
    answer = subprocess.run([*command, "--help"], capture_output=True, text=True, check=False)
    if answer.returncode:
        raise SystemExit(f"{command[0]} --help exits {answer.returncode}: {answer.stderr}")
    return answer.stdout


def parsed(text):
    """What a help text says: description, usage, and rows (name, argument, words) of each section."""
    described, _, rest = text.partition("Usage:")
    page = {"description": " ".join(described.split()), "usage": rest.split("\n", 1)[0].strip(),
            **{name: [] for name in EMPTY}, "footer": []}
    section, last = None, None
    for line in rest.split("\n")[1:]:
        word = line.strip().rstrip(":").lower()
        if line.strip().endswith(":") and word in EMPTY:
            section, last = word, None
        elif line and not line.startswith(" ") and not line.startswith("["):
            section = "footer"
            page["footer"].append(line)
        elif section == "options" and (found := OPTION.match(line)):
            last = [found[1], (found[2] or "").strip(), found[3] or ""]
            page["options"].append(last)
        elif section in ("positionals", "subcommands") and (found := ENTRY.match(line)):
            last = [found[1], found[2] or "", found[3] or ""]
            page[section].append(last)
        elif last and line.startswith(" " * 20) and line.strip():
            last[2] = f"{last[2]} {line.strip()}".strip()
    return page


def words_of(page):
    names = [name for row in page["options"] for name in row[0].split(",")]
    choices = [word for row in page["positionals"] for found in CHOICES.findall(row[1]) for word in found.split(",")]
    return " ".join(names + [row[0] for row in page["subcommands"]] + choices)


def values_of(page):
    """Lines of a case statement: what may follow an option."""
    for name, argument, _ in page["options"]:
        if choices := CHOICES.search(argument):
            yield f"    {name.replace(',', '|')}) COMPREPLY=($(compgen -W '{choices[1].replace(',', ' ')}' -- \"$now\")); return ;;"
        elif NUMBER.match(argument):
            yield f"    {name.replace(',', '|')}) COMPREPLY=(); return ;;"
        elif argument:
            yield f"    {name.replace(',', '|')}) {FILES}; return ;;"


def completion(program, page, subpages):
    function = "_" + program.replace("-", "_")
    lines = [f"# {program}: from its --help", f"{function}() {{",
             '  local now=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]}', f"  local words='{words_of(page)}'"]
    if subpages:
        lines.append('  case ${COMP_WORDS[1]} in')
        lines += [f"    {name}) words='{words_of(sub)}' ;;" for name, sub in subpages.items()]
        lines.append("  esac")
    values = list(dict.fromkeys(v for p in (page, *subpages.values()) for v in values_of(p)))
    if values:
        lines += ['  case $before in', *values, "  esac"]
    lines += ['  COMPREPLY=($(compgen -W "$words" -- "$now"))',
              "  [ ${#COMPREPLY[@]} -gt 0 ] || " + FILES, "}",
              f"complete -o filenames -F {function} {program}"]
    return "\n".join(lines) + "\n"


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return f"\\&{text}" if text[:1] in ".'" else text


def rows(page):
    for name, argument, words in page["positionals"] + page["options"]:
        yield ".TP"
        yield f".B {roff(name.replace(',', ', '))}" + (f" \\fI{roff(argument)}\\fR" if argument else "")
        yield roff(words) or "\\&"


def man(program, version, page, subpages):
    summary = page["description"] or program
    lines = [f'.TH {program.upper()} 1 "" "{roff(version)}" "chase"', ".SH NAME", f"{roff(program)} \\- {roff(summary)}",
             ".SH SYNOPSIS", roff(page["usage"]), ".SH OPTIONS", *rows(page)]
    for name, sub in subpages.items():
        lines += [f".SH {name.upper()}", roff(sub["usage"]), ".PP", roff(sub["description"]), *rows(sub)]
    if page["footer"]:
        lines += [".SH NOTES", *map(roff, page["footer"])]
    return "\n".join(lines) + "\n"


def main():
    words = script.arguments(__doc__, 2)
    bin_dir, out = pathlib.Path(words[0]).resolve(), pathlib.Path(words[1])
    completions, pages = out / "share/bash-completion/completions", out / "share/man/man1"
    for folder in (completions, pages):
        folder.mkdir(parents=True, exist_ok=True)
    programs = [bin_dir / name for name in words[2:]] or sorted(bin_dir.glob("chase-*"))
    for program in programs:
        page = parsed(help_of(program))
        subpages = {row[0]: parsed(help_of(program, row[0])) for row in page["subcommands"]}
        version = subprocess.run([program, "--version"], capture_output=True, text=True, check=False).stdout.strip()
        (completions / program.name).write_text(completion(program.name, page, subpages), encoding="utf-8")
        (pages / f"{program.name}.1").write_text(man(program.name, version, page, subpages), encoding="utf-8")
    print(f"{len(programs)} programs: {completions}, {pages}")


if __name__ == "__main__":
    main()
