"""Where things lie: in the source tree, or where the package has put them."""

import pathlib

SHARE = pathlib.Path(__file__).resolve().parents[1]  # deploy/, or share/chase: process table, scenarios
INSTALLED = not (SHARE / "setup").exists()
ROOT = pathlib.Path.cwd() if INSTALLED else SHARE.parent  # flights go below it, into logs/
RECORDS = pathlib.Path("/var/lib/chase") if INSTALLED else ROOT  # of the units
ENVIRONMENT = pathlib.Path("/etc/chase/environment")  # of the units
BIN = SHARE.parents[1] / "bin" if INSTALLED else ROOT / "build" / "bin"


def command(name):
    """What a user types to get here."""
    return f"chase-{name}" if INSTALLED else f"deploy/{name}"
