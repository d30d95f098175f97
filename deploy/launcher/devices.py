"""What the drivers of an installed vehicle are told to open: ports that nobody else may hold, devices
that have to be plugged in, and keys, theirs to read. A check answers (verdict, how things stand)."""

import errno
import grp
import os
import pathlib
import pwd
import re
import socket
import stat

import vehicle

OK, WARNING, FAILURE = "ok", "warning", "FAILURE"
GROUPS = ("video", "dialout")  # of the units, beside their user's own
FOLDER = pathlib.Path("/var/lib/chase")  # in which they run


def parameters(name):
    """The scalars of the process's file over its defaults, as text; none where the file is bad."""
    dump = vehicle.dumped(name).stdout
    return {key: value.strip('"') for key, value in re.findall(r'^(\w+): ("[^"]*"|\S+)', dump, re.MULTILINE)}


def port(number, kind, name):
    """Can the process have it? Its own hold on it is no trouble."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM if kind == "TCP" else socket.SOCK_DGRAM) as sock:
        if kind == "TCP":
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            sock.bind(("", int(number)))
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                return FAILURE, f"{kind} port {number}: {error.strerror}"
            if vehicle.runs(name):
                return OK, f"{kind} port {number}, held by chase-{name}"
            return FAILURE, (f"{kind} port {number} is held by another program; cure: ss -lnp | grep :{number} "
                             "says by which; stop it")
    return OK, f"{kind} port {number} is free"


def device(path):
    try:
        status = os.stat(path)
    except OSError:
        return WARNING, f"{path} is not there; cure: plug it in"
    try:
        group = grp.getgrgid(status.st_gid).gr_name
    except KeyError:
        group = str(status.st_gid)
    both = stat.S_IROTH | stat.S_IWOTH
    if group not in GROUPS and status.st_mode & both != both:
        return WARNING, (f"{path} is for the group {group}, the units have {' and '.join(GROUPS)}; "
                         "cure: a rule for udev that gives it to one of them")
    return OK, f"{path} is there"


def key(path):
    """A file of the configuration's that the units, which run as chase, have to read."""
    path = FOLDER / path
    try:
        user = pwd.getpwnam("chase")
        groups = {user.pw_gid, *(grp.getgrnam(name).gr_gid for name in GROUPS)}

        def may(file, bit):
            status = os.stat(file)
            shift = 6 if status.st_uid == user.pw_uid else 3 if status.st_gid in groups else 0
            return status.st_mode >> shift & bit

        if may(path, stat.S_IROTH) and all(may(folder, stat.S_IXOTH) for folder in path.parents):
            return OK, f"{path} is there"
    except KeyError as error:
        return FAILURE, f"{path}: {error.args[0]}; see user"
    except PermissionError:
        return WARNING, f"{path}: not looked at, its folder is private; cure: as root"
    except OSError as error:
        return FAILURE, f"{path}: {error.strerror}; cure: put the key there"
    return FAILURE, f"{path}: the user chase cannot read it; cure: chown chase {path}; chmod 600 {path}; in a folder that all may enter"


def worst(*answers):
    bad = [answer for verdict in (FAILURE, WARNING) for answer in answers if answer[0] == verdict]
    return bad[0] if bad else (OK, ", ".join(words for _, words in answers))


def with_key(answer, path):
    return worst(answer, key(path)) if path else answer


def lidar(told):
    if told["source"] != "udp":
        return OK, f"plays {told['source']}"
    ports = [told["port"], *([told["position_port"]] if told["clock"] == "gps" else [])]
    return worst(*(port(number, "UDP", "lidar") for number in ports))


def fcu(told):
    wire = port(told["port"], "UDP", "fcu") if told["link"] == "udp" else device(told["link"])
    return with_key(wire, told["signing_key_file"])


def camera(told):
    source = told["source"]
    if source.startswith("/dev/"):
        return device(source)
    there = "://" in source or source.startswith("gst:") or pathlib.Path(source).exists()
    return (OK, source) if there else (WARNING, f"{source} is not there; cure: camera.yaml: source")


def viewer(told):
    return port(told["port"], "TCP", "viewer")


def link(told):
    return with_key(port(told["port"], "UDP", "link"), told["key_file"])


def checked(check):
    told = parameters(check.__name__)
    return check(told) if told else (WARNING, f"{vehicle.file_of(check.__name__)} is not read; see configuration")


CHECKS = [(check.__name__, lambda check=check: checked(check)) for check in (lidar, fcu, camera, viewer, link)]
