"""Child processes: started in their own session, watched, stopped in order."""

import ctypes
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import time

PR_SET_PDEATHSIG = 1
READY_LIMIT = 30.0  # s
RETRY_AFTER = 12.0  # s without READY after which a process is started once more
WATCHDOG_LIMIT = 10.0  # s without a sign of life, once ready
SHORT_LIFE = 5.0  # s; who dies sooner after its start than that, and again, is started anew ever later:
BACK_OFF = (0.0, 0.5, 1.0, 2.0, 4.0)  # s, by the number of such deaths before in a row
STOP_LIMIT = 5.0  # s from SIGINT to SIGKILL


# Of a row of the process table (deploy/processes.json).
FIELDS = {"name": str, "binary": str, "heavy": bool, "fly": bool, "vehicle": bool, "restart": str, "nice": int,
          "priority": int, "cores": str}
RESTARTS = ("always", "never")


class TableError(Exception):
    """One line: which table, what is wrong."""


def read_table(data, origin):
    """The rows of a process table, given as bytes."""
    try:
        rows = json.loads(data)["processes"]
    except (ValueError, RecursionError, TypeError, KeyError) as error:
        raise TableError(f"{origin}: no map of JSON with a list of processes ({type(error).__name__})") from error
    if not isinstance(rows, list) or not rows:
        raise TableError(f"{origin}: processes is no list of rows")
    for number, row in enumerate(rows):
        if problem := _row_problem(row):
            raise TableError(f"{origin}: processes[{number}]: {problem}")
    names = [row["name"] for row in rows]
    if twice := [name for name in names if names.count(name) > 1]:
        raise TableError(f"{origin}: {twice[0]!r} is there twice")
    return rows


def _row_problem(row):
    if not isinstance(row, dict) or set(row) != set(FIELDS):
        return f"has to have {', '.join(FIELDS)} and nothing else"
    for field, kind in FIELDS.items():
        if type(row[field]) is not kind:
            return f"{field} is no {kind.__name__}"
    if not re.fullmatch(r"[a-z][a-z0-9_]*", row["name"]):
        return f"name is {row['name'][:40]!r}; it is a word in small letters"
    if not re.fullmatch(r"chase-[a-z0-9-]+", row["binary"]):
        return f"binary is {row['binary'][:40]!r}; it begins with chase-"
    if row["restart"] not in RESTARTS:
        return f"restart is {row['restart'][:40]!r}; it is one of {', '.join(RESTARTS)}"
    if not 0 <= row["priority"] <= 99:
        return f"priority is {row['priority']}, outside 0 (no real time) to 99"
    if not re.fullmatch(r"|\d{1,4}(-\d{1,4})?( \d{1,4}(-\d{1,4})?)*", row["cores"]):
        return f"cores is {row['cores'][:40]!r}; it is like '0 2-3', or empty for any"
    return "" if -20 <= row["nice"] <= 19 else "nice is outside -20 to 19"


def threads_state(pid):
    """What every thread of a process is doing, for a hang that cannot be watched: name, state, where
    in the kernel it waits, CPU time used."""
    words = []
    for task in sorted(pathlib.Path(f"/proc/{pid}/task").glob("*")):
        try:
            fields = (task / "stat").read_text().rpartition(")")[2].split()
            name, where = ((task / file).read_text().strip() for file in ("comm", "wchan"))
        except (OSError, ProcessLookupError):
            continue
        seconds = sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")
        words.append(f"{name} {fields[0]} in {where.strip('0') or 'user space'}, {seconds:.2f} s of CPU")
    return "; ".join(words) or "no thread to be seen"


def _die_with_parent():
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


class Child:
    """One process whose output goes to a file. With `notifies` it speaks sd_notify's protocol; with
    `restarts` its end is mended by restart()."""

    def __init__(self, name, command, log, env=None, notifies=False, restarts=False, stdin=subprocess.DEVNULL, stdout=None):
        self.name, self.log, self.restarts = name, log, restarts
        self._command, self._stdin, self._stdout, self._retried = command, stdin, stdout, False
        self._deaths, self._restart_at = 0, None  # in a row, each soon after a start
        self._environment = dict(os.environ, **(env or {}))
        self._environment.pop("NOTIFY_SOCKET", None)
        self._socket = self._notify_socket() if notifies else None
        self.start()

    def start(self):
        self._ready = not self._socket
        self._last_sign = self._started = time.monotonic()
        self._restart_at = None
        with open(self.log, "ab") as file:
            self.process = subprocess.Popen(
                self._command, stdin=self._stdin, stdout=self._stdout or file, stderr=file,
                env=self._environment, start_new_session=True, preexec_fn=_die_with_parent)

    def mend(self):
        """Starts it anew once the back-off is over; True when it did."""
        now = time.monotonic()
        if self._restart_at is None:
            if now - self._started >= SHORT_LIFE:
                self._deaths = 0
            self._restart_at = now + BACK_OFF[min(self._deaths, len(BACK_OFF) - 1)]
            self._deaths += 1
        if now < self._restart_at:
            return False
        self.restart()
        return True

    def restart(self):
        self.process.kill()  # where it hangs rather than has ended
        self.process.wait()
        self.start()

    def _notify_socket(self):
        address = f"chase-{os.getpid()}-{self.name}"  # abstract: "@" outside, a zero byte inside
        self._environment["NOTIFY_SOCKET"] = "@" + address
        sock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        sock.bind("\0" + address)
        sock.setblocking(False)
        return sock

    def _hear(self):
        while self._socket:
            try:
                words = self._socket.recv(4096).decode("ascii", "replace").split("\n")
            except BlockingIOError:
                return
            self._last_sign = time.monotonic()
            self._ready = self._ready or "READY=1" in words

    def ready(self):
        self._hear()
        return self._ready

    def problem(self):
        """A sentence when the process has ended or hangs, else ''."""
        code = self.process.poll()
        if code is not None:
            how = f"exit code {code}" if code >= 0 else signal.Signals(-code).name
            return f"{self.name} ended ({how})"
        if self.ready() and self._socket and time.monotonic() - self._last_sign > WATCHDOG_LIMIT:
            return (f"{self.name} has given no sign of life for {WATCHDOG_LIMIT:.0f} s "
                    f"({threads_state(self.process.pid)})")
        return ""

    def retry(self, after=RETRY_AFTER):
        """Starts a process that is not ready `after` seconds from its start once more, and says so."""
        if self._retried or self.ready() or time.monotonic() - self._last_sign < after:
            return
        print(f"warning: {self.name} is not ready after {after:.0f} s "
              f"({threads_state(self.process.pid)}): started once more", file=sys.stderr, flush=True)
        self._retried = True
        self.restart()

    def log_tail(self, lines=8):
        with open(self.log, encoding="utf-8", errors="replace") as file:
            return "".join(file.readlines()[-lines:]).rstrip()

    def ask_to_stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)

    def wait_stopped(self, deadline):
        try:
            self.process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        for opened in (self._socket, self.process.stdin, self.process.stdout):
            if opened:
                opened.close()


def problems(children):
    """(child, sentence) of each that has ended or hangs."""
    return [(child, sentence) for child in children if (sentence := child.problem())]


def first_problem(children):
    """The first of them, or (None, '')."""
    return next(iter(problems(children)), (None, ""))


def wait_ready(children):
    """True once all are ready; False when one ends or READY_LIMIT passes. Nothing flies yet, so that
    a process which does not come up is tried a second time."""
    deadline = time.monotonic() + READY_LIMIT
    while time.monotonic() < deadline:
        if first_problem(children)[0]:
            return False
        if all(child.ready() for child in children):
            return True
        for child in children:
            child.retry()
        time.sleep(0.05)
    return False


def stop(children):
    """SIGINT to all, then SIGKILL to those that stay."""
    for child in children:
        child.ask_to_stop()
    deadline = time.monotonic() + STOP_LIMIT
    for child in children:
        child.wait_stopped(deadline)
