"""Reads flight logs: LCM event logs with this project's messages. Python's standard library only.

Beside this file stands the package `chase`, one class per message type, as lcm-gen makes them.
"""

import collections
import mmap
import pathlib
import re
import struct
import sys
import warnings

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import chase  # noqa: E402

Event = collections.namedtuple("Event", "utime channel message")

_SYNC = struct.pack(">I", 0xEDA1DA01)
_HEADER = struct.Struct(">4sqqii")  # sync word, number, utime, bytes of the channel, of the message
_CHANNEL = re.compile(rb"[!-~]{1,63}")  # all else is damage
_LATEST = 1 << 61  # us: what is later, or earlier than minus that, is damage
_TYPES = {kind._get_packed_fingerprint(): kind for name, kind in vars(chase).items()
          if name.endswith("_t") and isinstance(kind, type)}


def decode(data):
    """The message in these bytes; the bytes themselves where their type is not known."""
    kind = _TYPES.get(data[:8])
    try:
        return kind.decode(data) if kind else data
    except (ValueError, struct.error, UnicodeDecodeError):
        return data


def read(path, *channels, damage=None):
    """Yields Event(utime [us], channel, message) in file order; of the channels named, or of all.

    `path`: a log, or a flight's folder, which stands for its flight.lcm. What is damaged is left out, as chase-log
    does, and a log that is cut off ends where it does; (place, bytes) of each such stretch goes into the list `damage`.
    Raises ValueError for a file that is no log, and at the log's end for a channel that it does not hold.
    """
    path = pathlib.Path(path)
    with open(path / "flight.lcm" if path.is_dir() else path, "rb") as file:
        if not file.read(1):
            raise ValueError(f"{file.name}: is empty; record the log again")
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as log:
            if not _begins(log, 0) and _find(log, 0, len(log)) == len(log):
                raise ValueError(f"{file.name}: is no LCM log (it does not begin with ED A1 DA 01)")
            wanted, held = {name.encode() for name in channels}, set()
            for utime, channel, data in _events(log, wanted, held, [] if damage is None else damage):
                yield Event(utime, channel.decode(), decode(data))
        if not wanted <= held:
            lacking, holds = (", ".join(sorted(name.decode() for name in names)) for names in (wanted - held, held))
            raise ValueError(f"{file.name}: holds nothing on {lacking}; its channels: {holds}")


def _events(log, wanted, held, damage):
    """`held` becomes the names of the log's channels."""
    at = 0
    while at < len(log):
        utime, name, end = _event(log, at)
        # What no event follows may have a wrong length, and then holds events itself.
        following = end if end and _begins(log, end) else _find(log, at + 1, end or len(log))
        if following != end:
            damage.append((at, following - at))
        else:
            held.add(log[name])
            if not wanted or log[name] in wanted:
                yield utime, log[name], log[name.stop:end]
        at = following


def _begins(log, at):
    """A sync word, or as much of one as the file still holds; its end is a beginning, too."""
    return _SYNC.startswith(log[at:at + 4])


def _event(log, at):
    """Stamp, place of the channel's name and end of the event there; the end is 0 where none can be."""
    if len(log) - at < _HEADER.size:
        return 0, None, 0
    sync, _, utime, n_channel, n_data = _HEADER.unpack_from(log, at)
    name = slice(at + _HEADER.size, at + _HEADER.size + max(0, n_channel))
    end = name.stop + n_data
    good = (sync == _SYNC and n_data >= 0 and end <= len(log) and abs(utime) <= _LATEST
            and _CHANNEL.fullmatch(log[name]))
    return utime, name, end if good else 0


def _find(log, at, to):
    """The first event from there on that another, or the end of the file, follows; `to`: there is none."""
    while (at := log.find(_SYNC, at, to)) >= 0:
        end = _event(log, at)[2]
        if end and _begins(log, end):
            return at
        at += 1
    return to


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
    """A dict per message of the channel: its fields by name, and `event_utime`. For pandas.

    Warns of messages that cannot be read, which are left out.
    """
    events = list(read(path, channel))
    rows = [{"event_utime": event.utime, **dict(fields(event.message))}
            for event in events if not isinstance(event.message, bytes)]
    if unread := len(events) - len(rows):
        warnings.warn(f"{path}: {channel}: {unread} message{'s' * (unread != 1)} cannot be read (of another version, or "
                      "damaged; see chase-log migrate)", stacklevel=2)
    return rows
