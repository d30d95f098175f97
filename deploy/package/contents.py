#!/usr/bin/env python3
"""What the package holds and the build does not: contents.py BUILD OUT VERSION, after cli_pages.py, writes
OUT/etc (a file of parameters for each process, all commented out), OUT/man1, OUT/completions,
OUT/changelog.gz and OUT/conffiles."""

import email.utils
import gzip
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import textwrap

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "deploy/launcher"))
sys.dont_write_bytecode = True
import script  # noqa: E402

MAINTAINER = "chase authors <authors@chase.example>"
NOT_PACKAGED = "chase-compare"  # of the tests


def fresh(folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def compressed(path, text):
    path.write_bytes(gzip.compress(text, 9, mtime=0))


def write_configs(build, out):
    """Files that override nothing: what is commented out is the default."""
    table = json.loads((ROOT / "deploy/processes.json").read_text(encoding="utf-8"))["processes"]
    for row in table:
        if row["vehicle"]:
            dump = subprocess.run([build / "bin" / row["binary"], "--dump-config"], capture_output=True, text=True,
                                  check=True).stdout
            head = f"# What {row['binary']} does otherwise than by default. The defaults are commented out.\n\n"
            body = "".join(f"#{line}\n" for line in dump.splitlines())
            (out / f"{row['name']}.yaml").write_text(head + body, encoding="utf-8")


def write_pages(build, out):
    man, completions = fresh(out / "man1"), fresh(out / "completions")
    for page in [*(build / "share/man/man1").glob("chase-*.1"), *(ROOT / "deploy/package").glob("chase-*.1")]:
        if page.stem != NOT_PACKAGED:
            compressed(man / f"{page.name}.gz", page.read_bytes())
    for file in (build / "share/bash-completion/completions").glob("chase-*"):
        if file.name != NOT_PACKAGED:
            shutil.copy(file, completions)
    for page in (ROOT / "deploy/package").glob("chase-*.1"):  # of scripts: the options that it names
        options = sorted(set(re.findall(r"--[a-z][a-z-]*", page.read_text(encoding="utf-8").replace("\\-", "-"))))
        (completions / page.stem).write_text(f"complete -o default -W '{' '.join(options)}' {page.stem}\n", encoding="utf-8")


def date():
    """Of the last commit, so that the same source makes the same package."""
    stamp = os.environ.get("SOURCE_DATE_EPOCH") or subprocess.run(
        ["git", "-C", ROOT, "log", "-1", "--format=%ct"], capture_output=True, text=True, check=False).stdout.strip()
    return email.utils.formatdate(float(stamp or (ROOT / "CHANGELOG.md").stat().st_mtime))


def changelog(version):
    """Debian's form of the newest part of CHANGELOG.md."""
    newest = re.split(r"^## .*$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), flags=re.MULTILINE)[1]
    entries = [" ".join(entry.split()) for entry in re.split(r"^- ", newest, flags=re.MULTILINE)[1:]]
    entries = "\n".join(textwrap.fill(entry, 78, initial_indent="  * ", subsequent_indent="    ", break_on_hyphens=False) for entry in entries)
    return f"chase ({version}) bookworm; urgency=medium\n\n{entries}\n\n -- {MAINTAINER}  {date()}\n"


def main():
    *folders, version = script.arguments(__doc__, 3, 3)
    build, out = map(pathlib.Path, folders)
    etc = fresh(out / "etc")
    write_configs(build, etc)
    write_pages(build, out)
    compressed(out / "changelog.gz", changelog(version).encode())
    names = sorted([*(file.name for file in etc.iterdir()), "environment"])
    (out / "conffiles").write_text("".join(f"/etc/chase/{name}\n" for name in names), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
