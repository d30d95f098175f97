"""Builds, starts every process with the simulator, watches the flight, and judges it."""

import argparse
import datetime
import json
import math
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time

import bus
import commands
import places
import processes
import results
import strain
import version

ROOT, BIN = places.ROOT, places.BIN
SILENCE_LIMIT = 30.0  # s of wall time in which the mission's time must move
TAIL = 1.0  # s recorded after the mission's end
KEEP_FREE = 200  # MB of disk below which sweeps and images are no longer recorded
LOG_RATE = 15e6  # bytes/s of a recording, sweeps and images included
LARGEST_SEED = 2**31 - 1
DRIVERS = ("lidar", "fcu", "camera")  # stand between the simulator and the rest with --hardware
STRIKES = {"kill": signal.SIGKILL, "freeze": signal.SIGSTOP, "thaw": signal.SIGCONT}  # faults of processes
FREEZE = 2.0  # s of --kill freeze-P, as in lockstep
VIEW_PORTS = range(8080, 8100)  # of --view: the first that nobody listens on


class FlightError(Exception):
    """One line: what, where, cure."""


def kill_wish(text):
    """(process or effect-process, mission time in s) of P@SECONDS, kill-P@SECONDS or freeze-P@SECONDS."""
    name, _, seconds = text.partition("@")
    if not re.fullmatch(r"\d+(\.\d+)?", seconds):
        raise argparse.ArgumentTypeError(f"{text}: '{seconds}' is no mission time in s; give {name}@SECONDS, 0 or more")
    return name, float(seconds)


class Parser(argparse.ArgumentParser):
    def error(self, message):
        raise FlightError(f"{message}; see {places.command('fly')} --help")


def seed_number(text):
    if not (text.isascii() and text.isdigit() and int(text) <= LARGEST_SEED):
        raise argparse.ArgumentTypeError(f"{text} is no whole number from 0 to {LARGEST_SEED}")
    return int(text)


def parse(arguments):
    parser = Parser(prog=places.command("fly"), description=__doc__)
    parser.add_argument("scenario", nargs="?", default="gym",
                        help="name of a scenario, or a file (default: gym)")
    parser.add_argument("--seed", type=seed_number, default=1, help="of noise and gusts (default: 1)")
    parser.add_argument("--version", action="version", version=version.text())
    parser.add_argument("--hardware", action="store_true",
                        help="through the drivers: MAVLink, VLP-16 packets and a video stream in LCM's place")
    parser.add_argument("--view", action="store_true", help="look on in a browser, at http://localhost:8080")
    parser.add_argument("--token-file", type=pathlib.Path, metavar="FILE",
                        help="with --view: its first line is the token by which pages command (default: they cannot)")
    parser.add_argument("--link", action="store_true", help="with chase-link, as on a vehicle whose ground station is not there")
    parser.add_argument("--kill", type=kill_wish, action="append", default=[], metavar="P@SECONDS",
                        help="kill -9 of process P at that mission time; it is started anew. freeze-P: it stands still for "
                             f"{FREEZE:g} s (may be repeated)")
    options = parser.parse_args(arguments)
    if options.token_file and not options.view:
        parser.error(f"argument --token-file: {options.token_file} needs --view")
    if options.token_file and not options.token_file.is_file():
        parser.error(f"argument --token-file: no file {options.token_file}; cure: openssl rand -hex 16 > {options.token_file}")
    there = killable(options.hardware, options.view, options.link)
    for wish, seconds in options.kill:
        name = wish.removeprefix("kill-").removeprefix("freeze-")
        if name not in there:
            parser.error(f"argument --kill: {wish}@{seconds:g}: no process '{name}' to kill; there are: {', '.join(there)}")
    return options


def find_scenario(name):
    scenarios = places.SHARE / "scenarios"
    for path in (scenarios / f"{name}.yaml", scenarios / "twelve" / f"{name}.yaml", pathlib.Path(name)):
        if path.is_file():
            return path.resolve()
    # Scenes and planners' parameters lie there as well; only scenarios have a name.
    known = sorted(str(path.relative_to(scenarios).with_suffix(""))
                   for path in scenarios.rglob("*.yaml")
                   if re.search("^name:", path.read_text(encoding="utf-8"), re.MULTILINE))
    raise FlightError(f"no scenario '{name}'; there are: {', '.join(known)}")


def process_table():
    table = places.SHARE / "processes.json"
    try:
        return processes.read_table(table.read_bytes(), table.name)
    except processes.TableError as error:
        raise FlightError(str(error)) from error


def flight_processes():
    return [row for row in process_table() if row["fly"]]


def driver_processes(hardware):
    return [row for row in process_table() if hardware and row["name"] in DRIVERS]


def killable(hardware, view, link=False):
    """What such a flight starts and goes on without."""
    rows = flight_processes() + driver_processes(hardware)
    return [row["name"] for row in rows if row["restart"] == "always"] + ["recorder"] + ["viewer"] * view + ["link"] * link


def set_up():
    if not places.INSTALLED and subprocess.run([ROOT / "deploy" / "setup"], check=False).returncode:
        raise FlightError("the set-up failed; its message above says why")


def build(*programs):
    """These programs, and nothing else that the tree holds."""
    command = [ROOT / "deploy" / "build", "build", "--", *programs]
    if not places.INSTALLED and subprocess.run(command, check=False).returncode:
        raise FlightError("the build failed; its messages above say why")


def ask(program, *arguments):
    """What a program prints; its one line as an error where it refuses."""
    answer = subprocess.run([BIN / program, *map(str, arguments)], capture_output=True, text=True,
                            check=False)
    if answer.returncode:
        raise FlightError(answer.stderr.strip() or f"{program} ended ({answer.returncode})")
    return answer.stdout


def build_and_check(scenario, seed, view=False, hardware=False, link=False):
    """Builds what flies. The scenario is read as soon as there is a program that can, long before
    the rest is built. Returns its length [s], take-off included, and what it tells of itself."""
    set_up()
    build("chase-scenario")
    told = json.loads(ask("chase-scenario", scenario, "--seed", seed))
    build(*(row["binary"] for row in flight_processes() + driver_processes(hardware)), "chase-flight", "chase-flight-monitor",
          "chase-recorder", "chase-report", "chase-command", "chase-log", "chase-lidar",
          *["chase-viewer"] * view, *["chase-link"] * link)
    ask("chase-flight", scenario, "--print-config", "simulator")  # reads the services' overrides
    return told["duration_s"] + told["settle_s"], told


def warn_of_disk(seconds):
    free, need = shutil.disk_usage(ROOT).free, LOG_RATE * (seconds + TAIL)
    if free < need:
        print(f"warning: {free / 1e9:.1f} GB are free in {ROOT}, the recording takes about "
              f"{need / 1e9:.1f} GB; cure: remove old flights from {ROOT / 'logs'}",
              file=sys.stderr)


def raise_receive_buffers():
    """Large messages need room in the kernel; LCM asks for it and gets at most rmem_max."""
    if (bus.kernel("net/core/rmem_max") or 0) >= bus.RECEIVE_BUFFER:
        return
    command = ["sysctl", "-q", "-w", f"net.core.rmem_max={bus.RECEIVE_BUFFER}",
               f"net.core.rmem_default={bus.RECEIVE_BUFFER}"]
    if os.geteuid():
        command = ["sudo", "-n"] + command
    try:
        subprocess.run(command, check=False, stderr=subprocess.DEVNULL)
    except FileNotFoundError:
        pass
    if (bus.kernel("net/core/rmem_max") or 0) < bus.RECEIVE_BUFFER:
        print("warning: net.core.rmem_max is small, sweeps and images will be lost; "
              f"cure: sudo sysctl -w net.core.rmem_max={bus.RECEIVE_BUFFER}", file=sys.stderr)


def check_bus(url):
    where = bus.endpoint(url)
    if not where:
        raise FlightError(f"LCM_DEFAULT_URL={url}: not of the form udpm://ADDRESS:PORT?ttl=0")
    if any(row["heavy"] for row in flight_processes()) and not bus.stays_on_host(url):
        raise FlightError(f"LCM_DEFAULT_URL={url}: sweeps and images must stay on this host; "
                          "cure: add ttl=0")
    if problem := bus.loopback_problem(*where):
        raise FlightError(problem)
    if others := bus.foreign_channels(*where, seconds=0.5):
        raise FlightError(f"somebody is sending on port {where[1]} ({', '.join(others[:3])}); "
                          f"{bus.port_cure()}")


def flight_folder(scenario):
    stamp = datetime.datetime.now().strftime("%Y%m%d-%H%M%S")
    folder = ROOT / "logs" / f"{stamp}-{scenario.stem}"
    folder.mkdir(parents=True)
    return folder


def write_config(folder, scenario, seed, name):
    """The service's YAML for this scenario, as chase-flight would set it in lockstep."""
    path = folder / f"{name}.yaml"
    path.write_text(ask("chase-flight", scenario, "--seed", seed, "--print-config", name),
                    encoding="utf-8")
    return path


def rig_in(config):
    """The calibration in a service's YAML, as other services' files have it; empty where there is none."""
    block = re.search(r"^rig:.*\n(?:[ \t].*\n?)*", config, re.MULTILINE)
    return block.group() if block else ""


class Flight:
    """The processes of one flight and the folder that they leave."""

    def __init__(self, scenario, seed, url, told, kills=(), hardware=False):
        self.folder = flight_folder(scenario)
        self.scenario, self.seed, self.hardware = scenario, seed, hardware
        self.url, self.env = url, {"LCM_DEFAULT_URL": url}
        self.services, self.logger, self.monitor, self.viewer = [], None, None, None
        self.commands = commands.Commands(told.get("commands", ()), self.start_command)
        faults = told.get("faults", ())
        self.faults = {fault["name"]: fault for fault in faults}
        # Processes that hear of them on FAULT delay and lose what comes to them.
        self.bus_faults = {"CHASE_BUS_FAULTS": str(seed)} if any(fault.get("bus") for fault in faults) else {}
        self.strikes, self.killed, self.strained, self.disk = sorted(strikes_of(faults, kills)), [], {}, strain.FullDisk()

    def child(self, name, command, env=None, **options):
        return processes.Child(name, command, self.folder / f"{name}.log", {**self.env, **(env or {})}, **options)

    def start(self, view, token_file=None, link=False):
        rows = flight_processes() + driver_processes(self.hardware)
        configs = {row["name"]: write_config(self.folder, self.scenario, self.seed, row["name"])
                   for row in rows}
        # All that is said, in one log: reports and replays read it.
        self.logger = self.child("recorder", [
            BIN / "chase-recorder", "--folder", self.folder, "--name", "flight", "--heavy-minutes", "-1",
            "--rotate-mb", "0", "--rotate-minutes", "0", "--keep-free", str(KEEP_FREE)],
            notifies=True, restarts=True)
        self.monitor = self.child("monitor", [BIN / "chase-flight-monitor", "--faults"], stdin=subprocess.PIPE,
                                  stdout=subprocess.PIPE)
        os.set_blocking(self.monitor.process.stdout.fileno(), False)
        if view:
            self.start_viewer(rig_in(configs["perception"].read_text(encoding="utf-8")), token_file)
        if link:
            self.services.append(self.child("link", ["nice", "-n", "5", BIN / "chase-link"], notifies=True, restarts=True))
        # The simulator comes last: its clock starts when everybody listens.
        for row in sorted(rows, key=lambda r: r["name"] == "simulator"):
            if row["name"] == "simulator":
                self.wait_ready()
            command = ["nice", "-n", str(row["nice"]), BIN / row["binary"], "--config",
                       configs[row["name"]]]
            if self.hardware and row["name"] == "simulator":
                command.append("--hardware")
            self.services.append(self.child(row["name"], command, self.bus_faults, notifies=True,
                                            restarts=row["restart"] == "always"))
        self.wait_ready()

    def start_viewer(self, rig, token_file):
        """An onlooker: whatever becomes of it, the flight goes on."""
        port = bus.free_port(VIEW_PORTS)
        config = self.folder / "viewer.yaml"
        config.write_text(rig, encoding="utf-8")
        token = ["--token-file", token_file.resolve()] if token_file else []
        self.viewer = self.child("viewer", ["nice", "-n", "10", BIN / "chase-viewer", "--port", str(port), "--config", config, *token],
                                 restarts=True)
        bus.await_listener(port, 5.0)
        print(f"look on at http://localhost:{port}", flush=True)

    def wait_ready(self):
        if not processes.wait_ready([self.logger, *self.services]):
            self.complain(mend=False)
            late = ", ".join(c.name for c in [self.logger, *self.services] if not c.ready())
            raise FlightError(f"not ready after {processes.READY_LIMIT:.0f} s: {late}; "
                              f"their logs are in {self.folder}")

    def complain(self, *watchers, mend=True):
        """Restarts what may be restarted; else raises when a process has ended or hangs, or an interrupt was lost."""
        if interrupt.wished:
            raise KeyboardInterrupt
        onlookers = [self.viewer] if self.viewer and mend else []
        for child, sentence in processes.problems(self.services + [self.logger, *onlookers, *watchers]):
            if not (child.restarts and mend):
                raise FlightError(f"{sentence}; the end of {child.log}:\n{child.log_tail()}")
            if child.mend():
                print(f"\n{sentence}: restarted", file=sys.stderr, flush=True)

    def start_command(self, name, arguments):
        return self.child(name, [BIN / "chase-command", *arguments])

    def strike(self, mission_time):
        """Faults whose time has come, and ends of those before."""
        for child in [c for c in self.killed if c.process.poll() is None and c.ready()]:
            self.killed.remove(child)
            self.tell("-", f"kill-{child.name}")
        while self.strikes and self.strikes[0][0] <= mission_time:
            _, effect, name = self.strikes.pop(0)
            if effect in ("begins", "ends"):
                print(f"\nt {mission_time:6.1f} s: {name} {effect}", file=sys.stderr, flush=True)
                self.strain(effect, name)
                continue
            child = next(c for c in (*self.services, self.logger, self.viewer) if c and c.name == name)
            print(f"\nt {mission_time:6.1f} s: {effect} {'-9 of ' if effect == 'kill' else ''}{name}", file=sys.stderr, flush=True)
            self.tell(*(("-", f"freeze-{name}") if effect == "thaw" else ("+", f"{effect}-{name}")))
            child.process.send_signal(STRIKES[effect])
            if effect == "kill":
                child.process.wait()
                self.killed.append(child)

    def strain(self, effect, fault):
        """Begins or ends what strikes the processes' surroundings."""
        self.tell("+" if effect == "begins" else "-", fault)
        if fault == "disk-full":
            return self.disk.begin()
        if effect == "begins":
            for command in strain.commands(self.faults[fault], self.url):
                self.strained.setdefault(fault, []).append(self.child(fault, command))
            return
        for child in self.strained.pop(fault, []):
            child.process.kill()
            child.process.wait()

    def tell(self, sign, fault):
        """The monitor has it logged, for the report."""
        try:
            self.monitor.process.stdin.write(f"{sign}{fault}\n".encode())
            self.monitor.process.stdin.flush()
        except BrokenPipeError:
            pass  # watch() says that the monitor has ended

    def watch(self):
        """Shows progress until the mission's end."""
        last_time, moved, speed = None, time.monotonic(), 0.0
        while True:
            ended = self.monitor.process.poll() is not None  # asked before its last line is read
            line = self.monitor.process.stdout.readline()
            if line:
                progress = json.loads(line)
                show(progress)
                if progress["done"]:
                    return
                if progress["mission_time"] != last_time:
                    last_time, moved = progress["mission_time"], time.monotonic()
                    speed = progress["rtf"]
            if last_time is not None:  # progress comes once a second
                now = last_time + speed * (time.monotonic() - moved)
                self.commands.turn(now)
                self.strike(now)
            watched = [self.monitor] if ended and not line else []
            self.complain(*watched)
            self.disk.strike(self.logger.process)
            if time.monotonic() - moved > SILENCE_LIMIT:
                raise FlightError(f"the mission's time has not moved for {SILENCE_LIMIT:.0f} s; "
                                  f"the logs are in {self.folder}")
            if not line:
                time.sleep(0.1)

    def stop(self):
        """Services first, the logger last, so that the log holds their last words."""
        strained = [c for children in self.strained.values() for c in children]
        extras = [c for c in (self.monitor, self.viewer, *self.commands.given, *strained) if c]
        processes.stop(self.services + extras)
        if self.logger:
            processes.stop([self.logger])


def show(progress):
    text = (f"t {progress['mission_time']:6.1f} / {progress.get('duration', 0):.0f} s   "
            f"distance {progress['distance']:5.2f} m   visible {100 * progress['visible']:5.1f} %   "
            f"real-time factor {progress['rtf']:.2f}")
    if sys.stdout.isatty():
        print("\r" + text, end="\n" if progress["done"] else "", flush=True)
    else:
        print(text, flush=True)


def join_logs(folder):
    """A recorder that was started anew went on in another log; on a full disk nothing is in it."""
    logs = sorted(folder.glob("flight*.lcm"))
    for empty in [log for log in logs[1:] if not log.stat().st_size]:
        logs.remove(empty)
        empty.unlink()
    if len(logs) < 2:
        return
    whole = folder / "whole.lcm"
    ask("chase-log", "merge", *logs, whole)
    for log in logs:
        log.unlink()
    whole.rename(folder / "flight.lcm")


def report(folder):
    """Runs chase-report; prints the criteria. True when all hold."""
    join_logs(folder)
    command = [BIN / "chase-report", folder / "flight.lcm", "--out", folder]
    with open(folder / "report.log", "wb") as log:
        code = subprocess.run(command, stdout=log, stderr=log, check=False).returncode
    if code not in (0, 2):  # 2: reported as far as the log goes
        raise FlightError(f"chase-report failed (exit code {code}); see {folder / 'report.log'}")
    metrics = results.load(folder / "metrics.json")
    print("\n" + results.table(metrics))
    print(f"\nreport   {folder / 'report.html'}\nmetrics  {folder / 'metrics.json'}\n"
          f"log      {folder / 'flight.lcm'}")
    return results.passed(metrics)


def strikes_of(faults, kills):
    """(mission time in s, effect, process or fault) of a scenario's faults and the command line's kills."""
    wishes = [{"name": name if name.startswith(("kill-", "freeze-")) else f"kill-{name}", "at_s": t, "for_s": FREEZE}
              for name, t in kills]
    strikes = []
    for fault in [*wishes, *faults]:
        effect, _, name = fault["name"].partition("-")
        end = fault["at_s"] + (fault["for_s"] or math.inf)
        if effect not in STRIKES:
            strikes += [(fault["at_s"], "begins", fault["name"]), (end, "ends", fault["name"])]
            continue
        strikes.append((fault["at_s"], effect, name))
        if effect == "freeze":
            strikes.append((end, "thaw", name))
    return strikes


def fly(options):
    scenario = find_scenario(options.scenario)
    seconds, told = build_and_check(scenario, options.seed, options.view, options.hardware, options.link)
    if late := [f"{name}@{t:g}" for name, t in options.kill if t >= told["duration_s"]]:
        raise FlightError(f"--kill {', '.join(late)}: the mission ends at {told['duration_s']:g} s; give an earlier time")
    warn_of_disk(seconds)
    raise_receive_buffers()
    url = bus.url()
    check_bus(url)
    flight = Flight(scenario, options.seed, url, told, options.kill, options.hardware)
    print(f"flying {scenario.stem}, seed {options.seed}, into {flight.folder}", flush=True)
    try:
        flight.start(options.view, options.token_file, options.link)
        flight.watch()
        flight.commands.finish()
        time.sleep(TAIL)
        flight.complain()
    finally:
        flight.stop()
    passed = report(flight.folder)
    if flight.commands.failed:
        raise FlightError("the scenario's commands were not all obeyed: " + "; ".join(flight.commands.failed))
    late = [f"{effect} of {name}@{t:g}" for t, effect, name in flight.strikes
            if effect not in ("thaw", "ends")]
    late += flight.commands.left()
    if late:
        raise FlightError("the mission ended before the " + ", ".join(late))
    return 0 if passed else 1


def interrupt(*_):
    """Python only prints what is raised in a callback, as behind a fork: the wish is kept until somebody asks."""
    interrupt.wished = True
    raise KeyboardInterrupt


def main():
    # A terminal's Ctrl-C, a service manager's and a closed window's wishes end the flight alike.
    interrupt.wished = False
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, interrupt)
    try:
        return fly(parse(sys.argv[1:]))
    except FlightError as error:
        print(f"{places.command('fly')}: {error}", file=sys.stderr)
    except KeyboardInterrupt:
        print(f"{places.command('fly')}: stopped; everything it started has ended", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
