"""A scenario's commands in a live flight."""

import subprocess
import sys

LONGEST = 6.0  # s from a command to its answer or chase-command's giving up, with a margin


class Commands:
    """Gives each at its time, once the one before it is answered. Says what was refused or not answered."""

    def __init__(self, commands, start):
        """`start` runs chase-command: of the log's name and the arguments to the process."""
        self.waiting, self.given, self.failed = list(commands), [], []
        self._start, self._spec = start, None  # of the command that is not answered yet

    def turn(self, mission_time):
        self._hear()
        if self._spec or not self.waiting or self.waiting[0]["at_s"] > mission_time:
            return
        self._spec = self.waiting.pop(0)
        name = self._spec["command"]
        self.given.append(self._start(f"command-{len(self.given) + 1}-{name}", [name, *self._spec["arguments"]]))

    def finish(self):
        """Waits for the last answer."""
        if not self._spec:
            return
        try:
            self.given[-1].process.wait(LONGEST)
            self._hear()
        except subprocess.TimeoutExpired:
            self._fail("no answer")

    def left(self):
        """Those whose time has not come, as COMMAND@SECONDS."""
        return [f"{c['command']}@{c['at_s']:g}" for c in self.waiting]

    def _hear(self):
        code = self.given[-1].process.poll() if self._spec else None
        if code is None:
            return
        if code:
            self._fail(self.given[-1].log_tail(1).removeprefix("chase-command: ") or f"chase-command ended ({code})")
        self._spec = None

    def _fail(self, why):
        sentence = f"{self._spec['command']}@{self._spec['at_s']:g}: {why}"
        self.failed.append(sentence)
        print(f"\n{sentence}", file=sys.stderr, flush=True)
