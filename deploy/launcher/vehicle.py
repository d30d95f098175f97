"""What the doctor looks at where chase is installed: user, programs, configuration, units. Each check
answers (problem, how things stand); the problem is empty when all is well."""

import pathlib
import pwd
import subprocess

import places
import processes

CONFIGURATION = pathlib.Path("/etc/chase")


def rows():
    table = places.SHARE / "processes.json"
    return [row for row in processes.read_table(table.read_bytes(), table.name) if row["vehicle"]]


def run(*command):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)


def booted():
    return pathlib.Path("/run/systemd/system").is_dir()


def flies():
    return booted() and run("systemctl", "is-active", "chase.target").stdout.strip() == "active"


def runs(name):
    return booted() and run("systemctl", "is-active", f"chase-{name}").stdout.strip() == "active"


def user():
    try:
        pwd.getpwnam("chase")
    except KeyError:
        return "there is no user chase; cure: systemd-sysusers chase.conf", ""
    return "", "chase"


def programs():
    for row in rows():
        answer = run(places.BIN / row["binary"], "--version")
        if answer.returncode:
            return (f"{row['binary']} does not start: {answer.stderr.strip()}; cure: apt-get install -f, "
                    "or install chase again"), ""
    return "", f"{len(rows())} start, {answer.stdout.strip()}"


def file_of(name):
    return CONFIGURATION / f"{name}.yaml"


def dumped(name):
    """What the process would go by."""
    return run(places.BIN / f"chase-{name}", "--config", file_of(name), "--dump-config")


def configuration():
    for row in rows():
        answer = dumped(row["name"])
        if answer.returncode:
            return f"{answer.stderr.strip()}; cure: mend {file_of(row['name'])}", ""
    return "", f"the {len(rows())} files of {CONFIGURATION} are read"


def units():
    if not booted():
        return "", "systemd does not run here: not checked"
    failed = run("systemctl", "list-units", "--state=failed", "--plain", "--no-legend", "chase*").stdout.split("\n")[0]
    if failed:
        name = failed.split()[0]
        return f"{name} has failed; cure: journalctl -u {name} says why", ""
    down = [row["name"] for row in rows()
            if run("systemctl", "is-active", f"chase-{row['name']}").stdout.strip() == "activating"]
    if flies() and down:
        return f"not ready: {', '.join(down)}; cure: journalctl -u chase-{down[0]} says why", ""
    return "", f"chase.target is {'active' if flies() else 'not started: systemctl start chase.target'}"


CHECKS = [("user", user), ("programs", programs), ("configuration", configuration), ("units", units)]
