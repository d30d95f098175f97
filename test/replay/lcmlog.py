"""Reads and writes LCM event logs; no more than the tests need."""
import struct

SYNC = 0xEDA1DA01


def read(path):
    """Yields (utime, channel, data) in file order."""
    with open(path, "rb") as f:
        while header := f.read(28):
            sync, _, utime, n_channel, n_data = struct.unpack(">IqqII", header)
            assert sync == SYNC, f"{path}: not an LCM log"
            yield utime, f.read(n_channel).decode(), f.read(n_data)


def write(path, events):
    with open(path, "wb") as f:
        for number, (utime, channel, data) in enumerate(events):
            name = channel.encode()
            f.write(struct.pack(">IqqII", SYNC, number, utime, len(name), len(data)) + name + data)
