"""What --version says, in the words of the C++ programs."""

import re
import signal
import subprocess
import sys

import places

if __name__ == "__main__" or {"-h", "--help", "--version"} & set(sys.argv[1:]):
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # `--help | head -1` ends silently, as the C++ programs do


def text():
    if places.INSTALLED:
        command = [places.BIN / "chase-scenario", "--version"]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    number = re.search(r"project\(chase VERSION (\S+)", (places.ROOT / "CMakeLists.txt").read_text(encoding="utf-8"))[1]
    command = ["git", "-C", places.ROOT, "describe", "--always", "--dirty", "--abbrev=10", "--exclude=*"]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        answer = "unknown"
    return f"{number} (commit {answer})"


if __name__ == "__main__":
    print(text())
