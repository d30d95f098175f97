"""Reads flight logs: LCM event logs with this project's messages. Python's standard library only.

Beside this file stands the package `chase`, one class per message type, as lcm-gen makes them.
"""

import collections
import pathlib
import struct
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import chase  # noqa: E402

Event = collections.namedtuple("Event", "utime channel message")

_SYNC = struct.pack(">I", 0xEDA1DA01)
_HEADER = struct.Struct(">4sqqII")  # sync word, number, utime, bytes of the channel, of the message
_LONGEST_CHANNEL = 256  # bytes; more is damage
_TYPES = {kind._get_packed_fingerprint(): kind for name, kind in vars(chase).items()
          if name.endswith("_t") and isinstance(kind, type)}


def decode(data):
    """The message in these bytes; the bytes themselves where their type is not known."""
    kind = _TYPES.get(data[:8])
    try:
        return kind.decode(data) if kind else data
    except (ValueError, struct.error, UnicodeDecodeError):
        return data


def read(path, *channels):
    """Yields Event(utime [us], channel, message) in file order; of the channels named, or of all.

    What is damaged is left out, and a log that is cut off ends where it does.
    """
    wanted = {name.encode() for name in channels}
    with open(path, "rb") as file:
        while len(header := file.read(_HEADER.size)) == _HEADER.size:
            sync, _, utime, n_channel, n_data = _HEADER.unpack(header)
            if sync != _SYNC or n_channel > _LONGEST_CHANNEL:
                if not _resume(file, header):
                    return
                continue
            channel = file.read(n_channel)
            if wanted and channel not in wanted:
                file.seek(n_data, 1)
                continue
            data = file.read(n_data)
            if len(data) < n_data:
                return
            yield Event(utime, channel.decode(errors="replace"), decode(data))


def _resume(file, header):
    """Goes on to the next event after damage; False: there is none."""
    at = file.tell() - len(header) + 1
    file.seek(at)
    while chunk := file.read(1 << 20):
        if (found := chunk.find(_SYNC)) >= 0:
            file.seek(at + found)
            return True
        if len(chunk) < len(_SYNC):
            return False
        at += len(chunk) - len(_SYNC) + 1
        file.seek(at)
    return False


def fields(message, prefix=""):
    """(name, value) of every number and text of a message, in order: ("pos.0", 1.5), ..."""
    for name in message.__slots__:
        yield from _flat(getattr(message, name), prefix + name)


def _flat(value, name):
    if hasattr(value, "__slots__"):
        yield from fields(value, name + ".")
    elif isinstance(value, (list, tuple)):
        for i, item in enumerate(value):
            yield from _flat(item, f"{name}.{i}")
    else:
        yield name, value


def table(path, channel):
    """A dict per message of the channel: its fields by name, and `event_utime`. For pandas."""
    return [{"event_utime": event.utime, **dict(fields(event.message))}
            for event in read(path, channel) if not isinstance(event.message, bytes)]
