"""Reads and writes LCM event logs; no more than the tests need."""
import struct

SYNC = 0xEDA1DA01


def read(path):
    """Yields (utime, channel, data) in file order."""
    with open(path, "rb") as f:
        while header := f.read(28):
            sync, _, utime, n_channel, n_data = struct.unpack(">IqqII", header.ljust(28))
            if sync != SYNC:
                raise ValueError(f"{path}: not an LCM log, or damaged")
            channel, data = f.read(n_channel), f.read(n_data)
            if len(data) < n_data:
                raise ValueError(f"{path}: ends within a message; record it again")
            yield utime, channel.decode(), data


def write(path, events):
    with open(path, "wb") as f:
        for number, (utime, channel, data) in enumerate(events):
            name = channel.encode()
            f.write(struct.pack(">IqqII", SYNC, number, utime, len(name), len(data)) + name + data)


def sender(data):
    """Which every message names in its head."""
    size, = struct.unpack_from(">i", data, 20)
    return data[24:24 + size - 1].decode()


def after_head(data):
    """Where the fields go on that every message begins with: stamp, number, sender, vehicle, start, inputs."""
    def skip_string(at):
        return at + 4 + struct.unpack_from(">i", data, at)[0]
    at = skip_string(skip_string(20)) + 8
    inputs, = struct.unpack_from(">i", data, at)
    at += 4
    for _ in range(inputs):
        at = skip_string(at) + 4
    return at
