"""Checks this machine for flying: what is wrong, and the cure. Exit 1 when it cannot fly."""

import os
import pathlib
import shutil
import subprocess
import sys
import time

import bus
import devices
import places
import vehicle
import version
from devices import FAILURE, OK, WARNING

FREE_SPACE = 5e9  # bytes: a build and a few minutes of flight
CLOCK = pathlib.Path("/dev/shm/chase-clock")  # common/bus/host_clock.h


def packages():
    answer = subprocess.run([places.ROOT / "deploy" / "setup", "--check"], capture_output=True, text=True,
                            check=False)
    missing = answer.stdout.split()
    if answer.returncode or missing:
        return FAILURE, f"missing: {' '.join(missing)}; cure: deploy/setup"
    return OK, "all installed"


def receive_buffer():
    largest = bus.kernel("net/core/rmem_max") or 0
    if largest < bus.RECEIVE_BUFFER:
        return FAILURE, (f"net.core.rmem_max is {largest}, sweeps and images will be lost; cure: "
                         f"sysctl -w net.core.rmem_max={bus.RECEIVE_BUFFER}")
    return OK, f"net.core.rmem_max is {largest}"


def default_buffer():
    size = bus.kernel("net/core/rmem_default") or 0
    if size < bus.RECEIVE_BUFFER:
        return WARNING, (f"net.core.rmem_default is {size}; lcm-spy and other Java tools will lose "
                         f"sweeps and images; cure: sysctl -w "
                         f"net.core.rmem_default={bus.RECEIVE_BUFFER}")
    return OK, f"net.core.rmem_default is {size}"


def where():
    return bus.endpoint(bus.url())


def multicast():
    if not where():
        return FAILURE, f"LCM_DEFAULT_URL={bus.url()}: not of the form udpm://ADDRESS:PORT?ttl=0"
    problem = bus.loopback_problem(*where())
    return (FAILURE, problem) if problem else (OK, "own messages come back on %s:%d" % where())


def cross_talk():
    try:
        others = bus.foreign_channels(*where(), seconds=1.5)
    except (OSError, TypeError):
        return FAILURE, "cannot listen; see multicast"
    if others and places.INSTALLED and vehicle.flies():
        return OK, f"chase.target is active: its processes send on port {where()[1]}"
    if others:
        return FAILURE, (f"somebody is sending on port {where()[1]}: {', '.join(others[:5])}; "
                         f"{bus.port_cure()}")
    return OK, f"nobody else is sending on port {where()[1]}"


def read(path):
    try:
        return pathlib.Path(path).read_text(encoding="ascii", errors="replace").strip()
    except OSError:
        return ""


def clock_source():
    source = read("/sys/devices/system/clocksource/clocksource0/current_clocksource")
    if source in ("", "tsc", "kvm-clock", "arch_sys_counter", "hyperv_clocksource_tsc_page"):
        return OK, source or "not told by the kernel"
    return WARNING, f"{source} is slow to read; cure: boot with clocksource=tsc"


def host_clock():
    text = read(CLOCK)
    if not text:
        return OK, f"no {CLOCK}: the first process writes it"
    try:
        ahead = 1e-6 * (int(text) - (time.time_ns() - time.monotonic_ns()) // 1000)
    except ValueError:
        return WARNING, f"{CLOCK} holds no number; cure: systemctl stop chase.target, then rm {CLOCK}"
    if abs(ahead) > 1.0:
        return WARNING, (f"the processes' clock is {ahead:+.1f} s off this machine's, which was set since {CLOCK} was "
                         f"written; cure: systemctl stop chase.target, then rm {CLOCK}")
    return OK, f"the processes' is {ahead:+.3f} s off this machine's"


def time_service():
    if not shutil.which("timedatectl"):
        return OK, "no timedatectl: not checked (matters between machines only)"
    answer = subprocess.run(["timedatectl", "show", "-p", "NTPSynchronized", "--value"],
                            capture_output=True, text=True, check=False)
    if answer.stdout.strip() == "no":
        return WARNING, ("the clock is not synchronised (matters between machines only); "
                         "cure: timedatectl set-ntp true")
    return OK, "synchronised" if answer.stdout.strip() == "yes" else "not told by timedatectl"


def governor():
    name = read("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")
    if name in ("", "performance"):
        return OK, name or "no frequency scaling here"
    return WARNING, f"'{name}' adds latency; cure: cpupower frequency-set -g performance"


def cores():
    count = len(os.sched_getaffinity(0))
    if count < 2:
        return WARNING, "one core: the flight will be slower than real time; cure: give it two"
    return OK, f"{count}"


def disk():
    folder = places.RECORDS if places.RECORDS.exists() else places.ROOT
    free = shutil.disk_usage(folder).free
    if free < FREE_SPACE:
        return FAILURE, f"{free / 1e9:.1f} GB free in {folder}; cure: free {FREE_SPACE / 1e9:.0f} GB"
    return OK, f"{free / 1e9:.0f} GB free in {folder}"


def judged(check):
    """A check of the vehicle's says what is wrong, or nothing and how things stand."""
    problem, text = check()
    return (FAILURE, problem) if problem else (OK, text)


HERE = ([(name, lambda check=check: judged(check)) for name, check in vehicle.CHECKS] + devices.CHECKS
        if places.INSTALLED else [("packages", packages)])
CHECKS = [*HERE, ("receive buffer", receive_buffer),
          ("default buffer", default_buffer), ("multicast", multicast),
          ("cross talk", cross_talk), ("clock source", clock_source), ("host clock", host_clock), ("time", time_service),
          ("governor", governor), ("cores", cores), ("disk", disk)]


def main():
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(__doc__)
        return 0
    if "--version" in sys.argv[1:]:
        print(version.text())
        return 0
    if len(sys.argv) > 1:
        print(f"{places.command('doctor')}: takes no arguments", file=sys.stderr)
        return 1
    verdicts = []
    for name, check in CHECKS:
        verdict, text = check()
        verdicts.append(verdict)
        print(f"{verdict:<8} {name:<15} {text}")
    return 1 if FAILURE in verdicts else 0


if __name__ == "__main__":
    sys.exit(main())
