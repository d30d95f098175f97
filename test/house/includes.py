"""Checks every #include against the walls of the house (README, layout)."""

import re
import sys

import tree

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
CORE = re.compile(r"chase_library\(\s*(\w+_core)\s+([^)]*)\)")

# What a folder may include from the house besides itself.
ALLOWED = {
    "common/math": (),
    "common/track": (),
    "common/mavlink": ("common/math",),
    "common/world": ("common/math", "common/config"),  # config: scenario files
    "common/config": (),
    "common/bus": ("common/config", "common/math", "common/world", "chase"),
    "common/logs": ("common/bus", "common/world", "lcmtypes", "chase"),
}
SERVICE = ("common/math", "common/world", "common/track", "common/mavlink", "common/config", "common/bus", "chase")
VIEWER = SERVICE + ("common/logs",)  # the only service that knows messages of any type
CORE_ALLOWED = ("common/math", "common/world", "common/track", "common/mavlink")
# A core has no clock, file, log, randomness or thread of its own.
CORE_FORBIDDEN = {"chrono", "ctime", "thread", "mutex", "future", "atomic", "fstream", "iostream",
                  "random", "filesystem", "csignal", "unistd.h"}


def folder(path):
    """The wall that a path stands behind: 'services/control', 'common/math', 'chase', ..."""
    parts = path.split("/")
    return "/".join(parts[:2]) if parts[0] in ("common", "services") else parts[0]


def house_includes(path):
    """Includes of our own files, and of system headers, of one file."""
    found = INCLUDE.findall(tree.text(path))
    return [name for mark, name in found if mark == '"'], [n for mark, n in found if mark == "<"]


def allowed_from(home):
    if home in ALLOWED:
        return ALLOWED[home]
    if home == "services/viewer":
        return VIEWER
    return SERVICE if home.startswith("services/") else None  # None: tools and tests


def check_walls(path):
    home = folder(str(path))
    allowed = allowed_from(home)
    for name in house_includes(path)[0]:
        target = folder(name)
        if target == "test" and home != "test":
            yield f"{path}: includes {name}: nothing but tests includes test/"
        elif allowed is not None and target != home and target not in allowed:
            yield f"{path}: includes {name}: {home} may not know {target}"


def core_files(service):
    """The sources of the service's core target and the headers of the service that they reach."""
    cmake = tree.text(f"{service}/CMakeLists.txt")
    waiting = [f"{service}/{name}" for _, sources in CORE.findall(cmake) for name in sources.split()
               if name.endswith(".cpp")]
    reached = set()
    while waiting:
        path = waiting.pop()
        if path in reached or not (tree.ROOT / path).is_file():
            continue
        reached.add(path)
        waiting += [name for name in house_includes(path)[0] if folder(name) == service]
    return sorted(reached)


def check_core(service):
    for path in core_files(service):
        ours, system = house_includes(path)
        for name in ours:
            if folder(name) != service and folder(name) not in CORE_ALLOWED:
                yield f"{path}: includes {name}: a core knows common/math, world, track and mavlink only"
        for name in system:
            if name in CORE_FORBIDDEN or name.startswith(("lcm/", "spdlog/", "yaml-cpp/")):
                yield f"{path}: includes <{name}>: not in a core"


def main():
    problems = [p for path in tree.files("*.h", "*.cpp") for p in check_walls(path)]
    services = sorted({str(path.parent) for path in tree.files("services/*/CMakeLists.txt")})
    for service in services:
        if not core_files(service):
            problems.append(f"{service}/CMakeLists.txt: no chase_library(..._core ...)")
        problems += check_core(service)
    return tree.report(problems)


if __name__ == "__main__":
    sys.exit(main())
