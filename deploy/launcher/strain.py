"""What faults of a live flight's surroundings do: busy processes, a flood of the bus, a disk that takes nothing more."""

import math
import os
import random
import resource
import socket
import struct
import sys
import time

import bus

LONGEST = 200  # bytes of a malformed message, as in lockstep
FLUSHED = 0.5  # s: the recorder hands over what it has heard every 0.2 s


def commands(fault, url):
    """The processes that bring about a fault that chase-scenario told, as long as they live."""
    this = [sys.executable, "-B", __file__]
    if "channels" in fault:
        return [[*this, "flood", url, str(fault["rate_hz"]), *fault["channels"]]]
    if fault.get("bus"):
        return []  # each process delays and loses what it hears
    # Beside so many others on its core a process takes that many times as long.
    return [[*this, "work"]] * round((fault["times"] - 1) * os.cpu_count())


def packet(channel, seq, random_bytes):
    return struct.pack(">4sI", b"LC02", seq % 2**32) + channel.encode() + b"\0" + random_bytes


def flood(url, rate_hz, *channels):
    """Random bytes on every channel, so often a second, on this host."""
    draw, seq, where = random.Random(1), 0, bus.endpoint(url)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        due = time.monotonic()
        while True:
            for channel in channels:
                out.sendto(packet(channel, seq, draw.randbytes(draw.randrange(LONGEST))), where)
                seq += 1
            due += 1.0 / float(rate_hz)
            time.sleep(max(0.0, due - time.monotonic()))


class FullDisk:
    """From FLUSHED after its beginning on no file takes another byte of the recorder; its log has the FAULT of it, though."""

    def __init__(self):
        self._from, self._limited = math.inf, None

    def begin(self):
        self._from = time.monotonic() + FLUSHED

    def strike(self, recorder):
        """The process, once each: also one that was started anew."""
        if time.monotonic() >= self._from and recorder is not self._limited and recorder.poll() is None:
            resource.prlimit(recorder.pid, resource.RLIMIT_FSIZE, (0, 0))
            self._limited = recorder


def work():
    while True:
        pass


if __name__ == "__main__":
    {"flood": flood, "work": work}[sys.argv[1]](*sys.argv[2:])
