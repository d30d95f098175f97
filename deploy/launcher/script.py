"""What a script without options says to --help, to --version and to a wrong number of arguments."""

import pathlib
import sys

import version


def arguments(doc, least, most=None):
    """The words behind the script's name, `least` to `most` (None: as many as there are); otherwise it ends here."""
    words = sys.argv[1:]
    asked = next((word for word in words if word in ("-h", "--help", "--version")), "")
    if asked:
        print(version.text() if asked == "--version" else doc.strip())
        sys.exit()
    name = pathlib.Path(sys.argv[0]).name
    if words and words[0].startswith("-"):
        sys.exit(f"{name}: unknown option '{words[0]}'; see {name} --help")
    if len(words) < least or (most is not None and len(words) > most):
        takes = least if most == least else f"{least} or more" if most is None else f"{least} to {most}"
        sys.exit(f"{name}: takes {takes} arguments, not {len(words)}; see {name} --help")
    return words
