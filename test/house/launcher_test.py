"""The launcher of deploy/fly, flown with small stand-ins for the programs."""

import contextlib
import io
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import textwrap
import time
import unittest
import unittest.mock

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "deploy" / "launcher"))

import bus  # noqa: E402
import devices  # noqa: E402
import doctor  # noqa: E402
import fly  # noqa: E402
import places  # noqa: E402
import processes  # noqa: E402
import results  # noqa: E402
import strain  # noqa: E402

GROUP = "239.255.76.67"

SERVICE = """
    import os, signal, socket, sys, time
    signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
    address = "\\0" + os.environ["NOTIFY_SOCKET"][1:]
    notify = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    notify.sendto(b"READY=1", address)
    print("working", flush=True)
    {behaviour}
    while True:
        time.sleep(0.1)
"""
RECORD = """open(os.path.join(sys.argv[sys.argv.index("--folder") + 1], "flight.lcm"), "w").close()"""
MONITOR = """
    import json, signal, time
    for i in range(3):
        time.sleep(0.2)
        print(json.dumps(dict(mission_time=i, duration=2, distance=2.5, visible=1.0, rtf=1.0,
                              done=i == 2)), flush=True)
    signal.pause()  # however long the others take to come up
"""
REPORT = """
    import json, pathlib, sys
    out = pathlib.Path(sys.argv[sys.argv.index("--out") + 1])
    (out / "metrics.json").write_text(json.dumps({metrics}))
"""
LENGTH = """print('{{"duration_s": {duration}, "settle_s": 1}}')"""
PASSED = {"safe_ratio": 1.0, "criteria": {"safe_ratio": True, "in_image_ratio": True}}
FAILED = {"safe_ratio": 0.9, "criteria": {"safe_ratio": False, "in_image_ratio": True}}


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.bind(("", 0))
        return sock.getsockname()[1]


def lcm_packet(channel):
    return b"LC02" + struct.pack(">I", 7) + channel.encode() + b"\0payload"


class VersionTest(unittest.TestCase):
    def test_launchers_say_it_like_the_programs(self):
        for command in ("fly", "doctor", "spy"):
            answer = subprocess.run([ROOT / "deploy" / command, "--version"], capture_output=True, text=True,
                                    check=False)
            self.assertEqual((answer.returncode, answer.stderr), (0, ""), command)
            self.assertRegex(answer.stdout, r"^\d+\.\d+\.\d+ \(commit (unknown|[0-9a-f]{10}(-dirty)?)\)\n$")


class FlightTest(unittest.TestCase):
    """deploy/fly's own steps after the build, with programs that only pretend."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.bin = pathlib.Path(folder.name)
        self.patch(fly, "BIN", self.bin)
        self.patch(fly, "TAIL", 0.1)
        self.built = []
        self.patch(fly, "set_up", lambda: None)
        self.patch(fly, "build", lambda *programs: self.built.append(programs))
        self.patch(fly, "flight_folder", lambda scenario: self.make_folder())
        port = free_port()
        self.patch(os, "environ", dict(os.environ, LCM_DEFAULT_URL=f"udpm://{GROUP}:{port}?ttl=0"))
        for row in fly.flight_processes():
            self.program(row["binary"], SERVICE.format(behaviour=""))
        self.program("chase-scenario", LENGTH.format(duration=2))
        self.program("chase-flight", "print('{}')")
        self.program("chase-flight-monitor", MONITOR)
        self.program("chase-recorder", SERVICE.format(behaviour=RECORD))
        self.program("chase-report", REPORT.format(metrics=PASSED))

    def patch(self, place, name, value):
        self.addCleanup(setattr, place, name, getattr(place, name))
        setattr(place, name, value)

    def make_folder(self):
        self.folder = self.bin / "flight"
        self.folder.mkdir()
        return self.folder

    def program(self, name, source):
        path = self.bin / name
        path.write_text(f"#!{sys.executable}\n" + textwrap.dedent(source), encoding="utf-8")
        path.chmod(0o755)

    def fly(self, *options):
        """Exit code, and what deploy/fly printed on both streams."""
        scenario = self.bin / "hall.yaml"
        scenario.write_text("{}", encoding="utf-8")
        self.patch(sys, "argv", ["fly", str(scenario), *options])
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = fly.main()
        return code, out.getvalue(), err.getvalue()

    def test_flight_that_passes(self):
        code, out, err = self.fly()
        self.assertEqual((code, err), (0, ""))
        self.assertIn("t    2.0 / 2 s   distance  2.50 m   visible 100.0 %", out)
        self.assertRegex(out, r"safe_ratio +1 +passed")
        self.assertTrue((self.folder / "flight.lcm").exists())
        self.assertIn("working", (self.folder / "odometry.log").read_text(encoding="utf-8"))

    def test_builds_what_flies_and_what_reads_and_records(self):
        self.assertEqual(self.fly()[0], 0)
        first, rest = self.built
        self.assertEqual(first, ("chase-scenario",))
        flying = {row["binary"] for row in fly.flight_processes()}
        others = {"chase-flight", "chase-flight-monitor", "chase-recorder", "chase-report", "chase-command", "chase-log",
                  "chase-lidar"}
        self.assertEqual(set(rest), flying | others)

    def test_view_starts_an_onlooker(self):
        self.program("chase-viewer", "import sys; print(*sys.argv[1:], flush=True)")
        code, out, err = self.fly("--view")
        self.assertEqual(code, 0, err)  # that it ends at once is no concern of the flight
        self.assertIn("viewer ended (exit code 0): restarted", err)
        self.assertIn("chase-viewer", self.built[-1])
        port = re.search(r"look on at http://localhost:(\d+)", out).group(1)
        said = (self.folder / "viewer.log").read_text(encoding="utf-8")
        self.assertEqual(said.splitlines()[0], f"--port {port} --config {self.folder}/viewer.yaml")
        self.assertEqual((self.folder / "viewer.yaml").read_text(encoding="utf-8"), "")

    def test_view_knows_the_scenarios_rig_and_takes_commands_with_a_token(self):
        self.program("chase-viewer", "import sys; print(*sys.argv[1:], flush=True)")
        self.program("chase-flight", r"print('size: 1\nrig:  # where\n  focal_px: 300\n  lens: \"fisheye\"\ndetector:\n  kind: 1')")
        token = self.bin / "token"
        token.write_text("12345678\n", encoding="utf-8")
        code, _, err = self.fly("--view", "--token-file", str(token))
        self.assertEqual(code, 0, err)
        said = (self.folder / "viewer.log").read_text(encoding="utf-8")
        self.assertTrue(said.splitlines()[0].endswith(f" --token-file {token.resolve()}"), said)
        self.assertEqual((self.folder / "viewer.yaml").read_text(encoding="utf-8"),
                         'rig:  # where\n  focal_px: 300\n  lens: "fisheye"\n')

    def test_link_flies_along_and_is_started_anew(self):
        self.program("chase-link", SERVICE.format(behaviour=""))
        self.program("chase-flight-monitor", f"""
            import json, pathlib, signal, time
            def say(t, done=False):
                print(json.dumps(dict(mission_time=t, duration=2, distance=2.5, visible=1.0, rtf=0.0, done=done)), flush=True)
            log, end = pathlib.Path({str(self.bin / "flight/link.log")!r}), time.monotonic() + 20
            say(1)
            while time.monotonic() < end and not (log.exists() and log.read_text().count("working") == 2):
                time.sleep(0.1)
            say(2, done=True)
            signal.pause()
            """)
        code, _, err = self.fly("--link", "--kill", "link@1")
        self.assertEqual(code, 0, err)
        self.assertIn("chase-link", self.built[-1])
        self.assertIn("link ended (SIGKILL): restarted", err)

    def test_hardware_flies_through_the_drivers(self):
        for row in fly.flight_processes() + fly.driver_processes(True):
            self.program(row["binary"], SERVICE.format(behaviour="print(*sys.argv[1:], flush=True)"))
        self.assertEqual(self.fly("--hardware")[0], 0)
        for name in ("fcu", "lidar", "camera"):
            self.assertIn(f"chase-{name}", self.built[-1])
            said = (self.folder / f"{name}.log").read_text(encoding="utf-8")
            self.assertIn(f"--config {self.folder / name}.yaml", said)
            self.assertNotIn("--hardware", said)
        self.assertIn("--hardware", (self.folder / "simulator.log").read_text(encoding="utf-8"))

    def test_drivers_fly_only_where_they_are_asked_for(self):
        self.assertEqual(self.fly()[0], 0)
        self.assertFalse((self.folder / "fcu.log").exists())
        self.assertNotIn("--hardware", (self.folder / "simulator.log").read_text(encoding="utf-8"))

    def test_view_takes_a_free_port(self):
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as sock:
            sock.bind(("", 0))
            sock.listen()
            taken = sock.getsockname()[1]
            self.assertEqual(bus.free_port([taken]), 0)

    def test_scenario_is_read_before_the_build(self):
        self.program("chase-scenario", "import sys; sys.exit('hall.yaml:3: speed is -1')")
        code, out, err = self.fly()
        self.assertEqual((code, out, err), (1, "", "deploy/fly: hall.yaml:3: speed is -1\n"))
        self.assertEqual(self.built, [("chase-scenario",)])
        self.assertFalse(hasattr(self, "folder"))

    def test_bad_override_leaves_no_folder(self):
        self.program("chase-flight", "import sys; sys.exit('planning:1: unknown key')")
        code, out, err = self.fly()
        self.assertEqual((code, out, err), (1, "", "deploy/fly: planning:1: unknown key\n"))
        self.assertFalse(hasattr(self, "folder"))

    def test_disk_that_is_too_small_is_said(self):
        self.program("chase-scenario", LENGTH.format(duration=1e9))
        code, _, err = self.fly()
        self.assertEqual(code, 0)
        self.assertIn("the recording takes about", err)

    def test_bad_use_is_told_before_anything_is_built(self):
        for arguments in (["gmy"], ["--seed", "-1"], ["--seed", "1.5"], ["--seed", str(2**31)],
                          ["--seed", "nan"], ["--no-such"], ["--kill", "simulator@3"],
                          ["--kill", "planning"], ["--kill", "planning@-1"], ["--kill", "planning@nan"],
                          ["--token-file", __file__], ["--view", "--token-file", "no-such"]):
            with self.subTest(arguments=arguments):
                self.patch(sys, "argv", ["fly", *arguments])
                err = io.StringIO()
                with contextlib.redirect_stderr(err):
                    self.assertEqual(fly.main(), 1)
                self.assertEqual(err.getvalue().count("\n"), 1)
                self.assertIn(arguments[-1], err.getvalue())
        self.assertEqual(self.built, [])

    def test_known_scenarios_are_named(self):
        with self.assertRaises(fly.FlightError) as refusal:
            fly.find_scenario("gmy")
        names = str(refusal.exception).split("there are: ")[1].split(", ")
        self.assertEqual(sorted(names), sorted(
            ["corridor", "crossing", "forest", "gym", "long", "lost", "mission", "night"]
            + [f"twelve/S{number}" for number in range(1, 13)]))

    def test_criterion_that_fails(self):
        self.program("chase-report", REPORT.format(metrics=FAILED))
        code, out, _ = self.fly()
        self.assertEqual(code, 1)
        self.assertRegex(out, r"safe_ratio +0.9 +FAILED")

    def test_no_criteria_is_no_pass(self):
        self.program("chase-report", REPORT.format(metrics={}))
        self.assertEqual(self.fly()[0], 1)

    def test_process_that_dies_ends_the_flight(self):
        dying = "time.sleep(0.3); print('broken wing', flush=True); sys.exit(3)"
        self.program("chase-simulator", SERVICE.format(behaviour=dying))
        self.program("chase-flight-monitor", "import time; time.sleep(60)")
        code, _, err = self.fly()
        self.assertEqual(code, 1)
        self.assertIn("simulator ended (exit code 3)", err)
        self.assertIn("broken wing", err)

    def test_monitor_may_end_before_it_is_read(self):
        self.program("chase-flight-monitor", MONITOR.replace("time.sleep(0.2)", "pass").replace("signal.pause()", ""))
        code, _, err = self.fly()
        self.assertEqual((code, err), (0, ""))

    def test_process_that_may_be_restarted(self):
        rows = fly.flight_processes()
        self.patch(fly, "flight_processes", lambda: [
            dict(row, restart="always" if row["name"] == "mapping" else "never") for row in rows])
        mark = self.bin / "died"
        last = str(self.bin / "flight" / "simulator.log")  # of those that come up
        up = f"[time.sleep(0.1) for _ in range(200) if not (os.path.exists({last!r}) and os.path.getsize({last!r}))]"
        once = f"open({str(mark)!r}, 'x'); {up}; time.sleep(0.3); sys.exit(3)"
        self.program("chase-mapping", SERVICE.format(
            behaviour=f"if not os.path.exists({str(mark)!r}): {once}"))
        self.program("chase-flight-monitor", textwrap.dedent(f"""
            import pathlib, time
            log, end = pathlib.Path({str(self.bin / "flight/mapping.log")!r}), time.monotonic() + 20
            while time.monotonic() < end and not (log.exists() and log.read_text().count("working") == 2):
                time.sleep(0.1)
            """) + textwrap.dedent(MONITOR))
        code, _, err = self.fly()
        self.assertEqual(code, 0, err)
        self.assertIn("mapping ended (exit code 3): restarted", err)

    def test_kill_at_a_mission_time_and_restart(self):
        # It goes on until both are back, however long that takes.
        self.program("chase-flight-monitor", f"""
            import json, pathlib, signal, time
            def say(t, done=False):
                print(json.dumps(dict(mission_time=t, duration=2, distance=2.5, visible=1.0, rtf=0.0, done=done)), flush=True)
                time.sleep(0.2)
            folder, end = pathlib.Path({str(self.bin / "flight")!r}), time.monotonic() + 20
            for t in (0, 0.5, 1):
                say(t)
            logs = [folder / "planning.log", folder / "control.log"]
            while time.monotonic() < end and any(
                    not log.exists() or log.read_text().count("working") < 2 for log in logs):
                time.sleep(0.1)
            say(2, done=True)
            signal.pause()
            """)
        code, _, err = self.fly("--kill", "planning@1", "--kill", "control@0.5")
        self.assertEqual(code, 0, err)
        for name, others in (("planning", 2), ("control", 2), ("mapping", 1)):
            log = (self.folder / f"{name}.log").read_text(encoding="utf-8")
            self.assertEqual(log.count("working"), others, name)
        for name in ("planning", "control"):
            self.assertRegex(err, rf"t +[01]\.\d s: kill -9 of {name}\n")
            self.assertIn(f"{name} ended (SIGKILL): restarted", err)
        self.assertLess(err.index("of control"), err.index("of planning"))

    def test_faults_of_processes_strike_and_are_told_to_the_log(self):
        faults = [{"name": "freeze-planning", "at_s": 0.5, "for_s": 0.4}, {"name": "kill-control", "at_s": 0.6, "for_s": 0.5}]
        told = json.dumps({"duration_s": 2, "settle_s": 1, "faults": faults})
        self.program("chase-scenario", f"print({told!r})")
        # It goes on until all four are told, however long that takes.
        self.program("chase-flight-monitor", f"""
            import json, pathlib, signal, sys
            def say(t, done=False):
                print(json.dumps(dict(mission_time=t, duration=2, distance=2.5, visible=1.0, rtf=1.0, done=done)), flush=True)
            say(0.4)
            lines = [sys.stdin.readline() for _ in range(4)]
            pathlib.Path({str(self.bin / "told")!r}).write_text("".join(lines))
            say(2, done=True)
            signal.pause()
            """)
        code, _, err = self.fly()
        self.assertEqual(code, 0, err)
        self.assertRegex(err, r"t +0\.\d s: freeze planning\n\nt +[01]\.\d s: kill -9 of control\n")
        lines = (self.bin / "told").read_text(encoding="utf-8").split()
        self.assertEqual(lines[:2], ["+freeze-planning", "+kill-control"])
        self.assertEqual(set(lines[2:]), {"-freeze-planning", "-kill-control"})
        self.assertEqual((self.folder / "planning.log").read_text(encoding="utf-8").count("working"), 1)

    def test_strains_come_and_go_and_are_told_to_the_log(self):
        faults = [{"name": "flood", "at_s": -1, "for_s": 1.6, "rate_hz": 50, "channels": ["PLAN", "POSE"]},
                  {"name": "cpu-load", "at_s": -1, "for_s": 1.5, "times": 1 + 2 / os.cpu_count()}]
        told = json.dumps({"duration_s": 2, "settle_s": 1, "faults": faults})
        self.program("chase-scenario", f"print({told!r})")
        self.program("chase-flight-monitor", f"""
            import json, os, pathlib, signal, sys, time
            sys.path.insert(0, {str(ROOT / "deploy/launcher")!r})
            import bus
            def say(t, done=False):
                print(json.dumps(dict(mission_time=t, duration=2, distance=2.5, visible=1.0, rtf=1.0, done=done)), flush=True)
            def busy_ones():
                siblings = pathlib.Path("/proc/%d/task/%d/children" % (os.getppid(), os.getppid())).read_text().split()
                return sum(b"strain.py\\0work" in pathlib.Path("/proc/%s/cmdline" % pid).read_bytes() for pid in siblings)
            say(-1)
            lines = [sys.stdin.readline() for _ in range(2)]
            time.sleep(0.3)  # until they have started
            busy, heard = busy_ones(), bus.foreign_channels(*bus.endpoint(bus.url()), 0.5)
            say(0.4)
            lines += [sys.stdin.readline() for _ in range(2)]
            time.sleep(0.2)
            left, late = busy_ones(), bus.foreign_channels(*bus.endpoint(bus.url()), 0.5)
            pathlib.Path({str(self.bin / "told")!r}).write_text(json.dumps([lines, busy, heard, left, late]))
            say(2, done=True)
            signal.pause()
            """)
        code, _, err = self.fly()
        self.assertEqual(code, 0, err)
        lines, *found = json.loads((self.bin / "told").read_text(encoding="utf-8"))
        self.assertEqual(lines, ["+cpu-load\n", "+flood\n", "-cpu-load\n", "-flood\n"])
        self.assertEqual(found, [2, ["PLAN", "POSE"], 0, []])
        self.assertRegex(err, r"t +-\d\.\d s: cpu-load begins\n")

    def test_a_load_is_as_many_times_as_in_lockstep(self):
        load = strain.commands({"name": "cpu-load", "times": 5.0}, bus.url())
        self.assertEqual(len(load), 4 * os.cpu_count())

    def test_whatever_was_started_can_be_killed(self):
        self.assertEqual(fly.killable(False, False), ["odometry", "mapping", "perception", "prediction", "planning",
                                                      "control", "mission", "recorder"])
        self.assertEqual(fly.killable(True, True, True)[7:], ["lidar", "fcu", "camera", "recorder", "viewer", "link"])
        for wish, *options in (["recorder@1"], ["kill-recorder@1"], ["freeze-recorder@1"], ["freeze-viewer@1", "--view"],
                               ["kill-link@1", "--link"], ["freeze-link@1", "--link"], ["freeze-planning@1"]):
            self.assertEqual(fly.parse(["--kill", wish, *options]).kill, [(wish.removesuffix("@1"), 1.0)])
        for wish in ("link@1", "freeze-viewer@1", "melt-recorder@1"):
            with self.assertRaises(fly.FlightError):
                fly.parse(["--kill", wish])
        self.assertEqual(fly.strikes_of([], [("link", 1.0), ("freeze-recorder", 2.0)]),
                         [(1.0, "kill", "link"), (2.0, "freeze", "recorder"), (4.0, "thaw", "recorder")])
        for arguments in (["--kill", "fcu@1"], ["--kill", "viewer@1"], ["--kill", "simulator@1", "--hardware"]):
            code, _, err = self.fly(*arguments)
            self.assertEqual(code, 1)
            self.assertRegex(err, r"no process '\w+' to kill; there are: odometry, .*recorder")

    def test_recorder_is_started_anew_and_its_logs_are_joined(self):
        self.program("chase-recorder", SERVICE.format(behaviour="""
    folder = sys.argv[sys.argv.index("--folder") + 1]
    name = "flight-001" if os.path.exists(os.path.join(folder, "flight.lcm")) else "flight"
    open(os.path.join(folder, "flight-002.lcm"), "w").close()  # of one that found the disk full
    open(os.path.join(folder, name + ".lcm"), "w").write(name + "\\n")
    """))
        self.program("chase-log", """
            import pathlib, sys
            *logs, whole = sys.argv[2:]
            if not all(pathlib.Path(log).stat().st_size for log in logs):
                sys.exit("a log is empty")
            pathlib.Path(whole).write_text("".join(pathlib.Path(log).read_text() for log in logs))
            """)
        self.program("chase-flight-monitor", f"""
            import json, pathlib, signal, time
            def say(t, done=False):
                print(json.dumps(dict(mission_time=t, duration=2, distance=2.5, visible=1.0, rtf=0.0, done=done)), flush=True)
            end = time.monotonic() + 20
            say(1)
            while time.monotonic() < end and not pathlib.Path({str(self.bin / "flight/flight-001.lcm")!r}).exists():
                time.sleep(0.1)
            say(1.5, done=True)
            signal.pause()
            """)
        code, _, err = self.fly("--kill", "recorder@1")
        self.assertEqual(code, 0, err)
        self.assertIn("recorder ended (SIGKILL): restarted", err)
        self.assertEqual((self.folder / "flight.lcm").read_text(encoding="utf-8"), "flight-001\nflight\n")
        self.assertEqual([log.name for log in self.folder.glob("*.lcm")], ["flight.lcm"])

    def test_kill_that_comes_too_late_is_an_error(self):
        code, out, err = self.fly("--kill", "planning@2")
        self.assertEqual((code, out), (1, ""))
        self.assertIn("--kill planning@2: the mission ends at 2 s", err)
        self.program("chase-scenario", LENGTH.format(duration=3))  # the monitor ends it at 2 s
        code, _, err = self.fly("--kill", "planning@2.9")
        self.assertEqual(code, 1)
        self.assertIn("the mission ended before the kill of planning@2.9", err)

    def test_commands_are_given_with_their_arguments(self):
        commands = [{"command": "select", "at_s": 0.5, "arguments": ["180", "119.5"]},
                    {"command": "hold", "at_s": 0.5, "arguments": []},
                    {"command": "kill", "at_s": 1.0, "arguments": ["--force"]}]
        told = json.dumps({"duration_s": 2, "settle_s": 1, "commands": commands})
        self.program("chase-scenario", f"print({told!r})")
        self.program("chase-command", "import sys; print(*sys.argv[1:], flush=True)")
        # It goes on until all have spoken, however long that takes.
        self.program("chase-flight-monitor", f"""
            import json, pathlib, signal, time
            def say(t, done=False):
                print(json.dumps(dict(mission_time=t, duration=2, distance=2.5, visible=1.0, rtf=0.0, done=done)), flush=True)
            folder, end = pathlib.Path({str(self.bin / "flight")!r}), time.monotonic() + 20
            say(1)
            while time.monotonic() < end and sum(
                    log.stat().st_size > 0 for log in folder.glob("command-*.log")) < 3:
                time.sleep(0.1)
            say(2, done=True)
            signal.pause()
            """)
        code, _, err = self.fly()
        self.assertEqual((code, err), (0, ""))
        said = {log.stem: log.read_text(encoding="utf-8") for log in self.folder.glob("command-*.log")}
        self.assertEqual(said, {"command-1-select": "select 180 119.5\n", "command-2-hold": "hold\n",
                                "command-3-kill": "kill --force\n"})

    def give(self, commands, answers):
        """A flight that gives them, all due at once; it ends when so many answered. chase-command is that program."""
        told = json.dumps({"duration_s": 2, "settle_s": 1, "commands": [
            {"command": name, "at_s": at, "arguments": []} for name, at in commands]})
        self.program("chase-scenario", f"print({told!r})")
        self.program("chase-command", f"""
            import pathlib, sys, time
            name, book = sys.argv[1], pathlib.Path({str(self.bin / "book")!r})
            def note(word):
                with book.open("a") as file: file.write(word + chr(10))
            if name == "takeoff": time.sleep(0.3)
            note(name)
            if name == "chase": sys.exit("chase-command: refused: chase in IDLE: POSE is not heard")
            if name == "land": time.sleep(0.5)
            """)
        self.program("chase-flight-monitor", f"""
            import json, pathlib, signal, time
            def say(t, done=False):
                print(json.dumps(dict(mission_time=t, duration=2, distance=2.5, visible=1.0, rtf=0.0, done=done)), flush=True)
            book, end = pathlib.Path({str(self.bin / "book")!r}), time.monotonic() + 20
            say(1)
            while time.monotonic() < end and (not book.exists() or len(book.read_text().split()) < {answers}):
                time.sleep(0.1)
            say(2, done=True)
            signal.pause()
            """)
        code, _, err = self.fly()
        return code, err, (self.bin / "book").read_text(encoding="utf-8").split()

    def test_commands_come_in_order(self):
        names = ["takeoff", "hold", "stop"]
        self.assertEqual(self.give([(name, 0.5) for name in names], 3), (0, "", names))

    def test_refused_commands_are_said_and_fail_the_flight(self):
        code, err, _ = self.give([("chase", -2), ("hold", 0.5), ("land", 0.5)], 3)
        self.assertEqual(code, 1)
        refusal = "chase@-2: refused: chase in IDLE: POSE is not heard\n"
        self.assertEqual(err, f"\n{refusal}deploy/fly: the scenario's commands were not all obeyed: {refusal}")

    def test_commands_whose_time_never_came_fail_the_flight(self):
        code, err, _ = self.give([("hold", 0.5), ("land", 1.9)], 1)
        self.assertEqual((code, err), (1, "deploy/fly: the mission ended before the land@1.9\n"))

    def test_a_full_disk_is_the_recorders_alone_and_for_good(self):
        told = json.dumps({"duration_s": 2, "settle_s": 1, "faults": [{"name": "disk-full", "at_s": 0.4, "for_s": None}]})
        self.program("chase-scenario", f"print({told!r})")
        self.program("chase-flight-monitor", f"""
            import json, os, pathlib, signal, sys, time
            def say(t, done=False):
                print(json.dumps(dict(mission_time=t, duration=2, distance=2.5, visible=1.0, rtf=1.0, done=done)), flush=True)
            def limited():
                siblings = pathlib.Path("/proc/%d/task/%d/children" % (os.getppid(), os.getppid())).read_text().split()
                full = [pid for pid in siblings if "Max file size             0 " in pathlib.Path("/proc/%s/limits" % pid).read_text()]
                return ["chase-recorder" in pathlib.Path("/proc/%s/cmdline" % pid).read_text() for pid in full]
            say(0.4)
            found = [sys.stdin.readline(), limited()]  # the log has it before the disk is full
            time.sleep(1)
            pathlib.Path({str(self.bin / "told")!r}).write_text(json.dumps([*found, limited()]))
            say(2, done=True)
            signal.pause()
            """)
        code, _, err = self.fly()
        self.assertEqual(code, 0, err)
        self.assertEqual(json.loads((self.bin / "told").read_text(encoding="utf-8")), ["+disk-full\n", [], [True]])
        self.assertRegex(err, r"^\nt +0\.\d s: disk-full begins\n$")

    def fill_the_disk(self, watched):
        """Of a flight with a full disk from 0.5 s on: what this code of its monitor finds."""
        faults = [{"name": "cpu-load", "at_s": 0.0, "for_s": None, "times": 1}, {"name": "disk-full", "at_s": 0.5, "for_s": None}]
        told = json.dumps({"duration_s": 2, "settle_s": 1, "faults": faults})
        self.program("chase-scenario", f"print({told!r})")
        silent = SERVICE.replace('print("working", flush=True)', "")  # its output is a file, too
        self.program("chase-recorder", silent.format(behaviour=RECORD))
        self.program("chase-flight-monitor", """
            import json, os, pathlib, signal, sys, time
            def say(t, done=False):
                print(json.dumps(dict(mission_time=t, duration=2, distance=2.5, visible=1.0, rtf=0.0, done=done)), flush=True)
            def recorder(but=None):
                while True:
                    for pid in pathlib.Path("/proc/%d/task/%d/children" % (os.getppid(), os.getppid())).read_text().split():
                        if pid != but and "chase-recorder" in pathlib.Path("/proc/%s/cmdline" % pid).read_text():
                            return pid
                    time.sleep(0.01)
            def full(pid):
                return "Max file size             0 " in pathlib.Path("/proc/%s/limits" % pid).read_text()
            say(0.1)
            sys.stdin.readline()  # it flies
            {watched}
            pathlib.Path({out!r}).write_text(json.dumps(found))
            say(2, done=True)
            signal.pause()
            """.format(watched=watched, out=str(self.bin / "told")))
        code, _, err = self.fly()
        self.assertEqual(code, 0, err)
        return json.loads((self.bin / "told").read_text(encoding="utf-8")), err

    def test_the_disk_stays_full_for_a_recorder_that_is_started_anew(self):
        found, err = self.fill_the_disk("""
            first = recorder()
            say(0.6)
            time.sleep(1)
            found = [full(first)]
            os.kill(int(first), signal.SIGKILL)
            second = recorder(but=first)
            time.sleep(0.5)
            found.append(full(second))""")
        self.assertEqual(found, [True, True])
        self.assertIn("recorder ended (SIGKILL): restarted", err)

    def test_a_disk_may_be_full_while_there_is_no_recorder(self):
        self.patch(processes, "BACK_OFF", (2.0,))
        found, _ = self.fill_the_disk("""
            first = recorder()
            os.kill(int(first), signal.SIGKILL)
            time.sleep(0.5)
            say(0.6)
            second = recorder(but=first)
            time.sleep(0.5)
            found = full(second)""")
        self.assertTrue(found)

    def test_a_full_disk_holds_up_no_other_fault(self):
        self.patch(time, "sleep", unittest.mock.Mock(side_effect=time.sleep))
        found, _ = self.fill_the_disk("""
            say(0.6)
            time.sleep(1)
            found = full(recorder())""")
        self.assertTrue(found)
        self.assertLess(max(call.args[0] for call in time.sleep.call_args_list), strain.FLUSHED)

    def heard_of_bus_faults(self, *faults):
        """Which programs of a flight with these faults have the variable, and which have not; the flight."""
        told = json.dumps({"duration_s": 2, "settle_s": 1, "faults": faults})
        self.program("chase-scenario", f"print({told!r})")
        say = """print("bus faults:", os.environ.get("CHASE_BUS_FAULTS"), flush=True)"""
        for row in fly.flight_processes():
            self.program(row["binary"], SERVICE.format(behaviour=say))
        self.program("chase-recorder", SERVICE.format(behaviour=f"{say}; {RECORD}"))
        code, _, err = self.fly()
        self.assertEqual(code, 0, err)
        logs = {row["name"]: self.folder / f"{row['name']}.log" for row in fly.flight_processes()}
        logs["recorder"] = self.folder / "recorder.log"
        said = {name: log.read_text(encoding="utf-8").split("bus faults: ")[1].strip() for name, log in logs.items()}
        self.assertEqual(set(said.values()) - {"1", "None"}, set())
        return {name for name in said if said[name] == "1"}, err

    def test_processes_delay_and_lose_where_the_scenario_says_so(self):
        services = {row["name"] for row in fly.flight_processes()}
        struck, err = self.heard_of_bus_faults({"name": "delay-POSE", "at_s": 0.2, "for_s": 0.5, "bus": True})
        self.assertEqual(struck, services, "not the recorder")
        self.assertRegex(err, r"t +\d\.\d s: delay-POSE begins\n\nt +\d\.\d s: delay-POSE ends\n")

    def test_processes_hear_of_no_other_faults(self):
        struck, _ = self.heard_of_bus_faults({"name": "cpu-load", "at_s": 0.2, "for_s": 0.5, "times": 1})
        self.assertEqual(struck, set())

    def test_sweeps_stay_on_the_host(self):
        os.environ["LCM_DEFAULT_URL"] = f"udpm://{GROUP}:{free_port()}?ttl=1"
        code, _, err = self.fly()
        self.assertEqual(code, 1)
        self.assertIn("ttl=0", err)

    def test_the_bus_has_one_variable(self):
        for told, url in ((None, bus.DEFAULT_URL), ("", bus.DEFAULT_URL),
                          ("udpm://239.1.2.3:7", "udpm://239.1.2.3:7?recv_buf_size=2097152"),
                          ("udpm://239.1.2.3:7?ttl=0", "udpm://239.1.2.3:7?ttl=0&recv_buf_size=2097152"),
                          ("udpm://239.1.2.3:7?recv_buf_size=9", "udpm://239.1.2.3:7?recv_buf_size=9")):
            os.environ.pop("LCM_DEFAULT_URL", None)
            if told is not None:
                os.environ["LCM_DEFAULT_URL"] = told
            self.assertEqual(bus.url(), url)

    def test_the_bus_of_an_installed_vehicle(self):
        file = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory())) / "environment"
        self.assertIsNone(bus.configured(file))
        file.write_text("# LCM_DEFAULT_URL=no\nCHASE_OPTIONS=--channel-prefix falcon_\n")
        self.assertIsNone(bus.configured(file))
        file.write_text('LCM_DEFAULT_URL="udpm://239.1.2.3:7000?ttl=0"\n')
        self.assertEqual(bus.configured(file), "udpm://239.1.2.3:7000?ttl=0")
        self.patch(places, "ENVIRONMENT", file)
        os.environ.pop("LCM_DEFAULT_URL")
        self.assertEqual(bus.url(), bus.DEFAULT_URL, "the source tree's own")
        self.patch(places, "INSTALLED", True)
        self.assertTrue(bus.url().startswith("udpm://239.1.2.3:7000?"), "doctor, fly and spy")
        os.environ["LCM_DEFAULT_URL"] = "udpm://239.1.2.3:7001?ttl=0&recv_buf_size=1"
        self.assertEqual(bus.url(), os.environ["LCM_DEFAULT_URL"])

    def test_process_that_refuses_to_start(self):
        self.program("chase-planning", "import sys; sys.exit('planning.yaml:1: no_such: unknown')")
        code, _, err = self.fly()
        self.assertEqual(code, 1)
        self.assertIn("planning ended (exit code 1)", err)
        self.assertIn("no_such: unknown", err)

    def test_nobody_is_left_behind(self):
        self.fly()
        left = subprocess.run(["pgrep", "-f", str(self.bin)], capture_output=True, text=True,
                              check=False).stdout
        self.assertEqual(left, "")

    def test_interrupt_stops_everything(self):
        self.program("chase-flight-monitor",
                     f"import os, signal, time\nos.kill({os.getpid()}, signal.SIGINT)\n"
                     "time.sleep(60)")
        code, _, err = self.fly()
        self.assertEqual(code, 1)
        self.assertIn("stopped", err)

    def test_an_interrupt_behind_a_fork_stops_everything_too(self):
        armed = [True]

        def strike():  # what is raised in here is lost
            if armed and armed.pop():
                os.kill(os.getpid(), signal.SIGINT)

        os.register_at_fork(after_in_parent=strike)
        self.program("chase-flight-monitor", "import time\ntime.sleep(60)")
        code, _, err = self.fly()
        self.assertEqual((code, armed), (1, []))
        self.assertIn("stopped", err)

    def test_others_on_the_port_are_an_error(self):
        port = bus.endpoint(os.environ["LCM_DEFAULT_URL"])[1]
        talker = subprocess.Popen([sys.executable, "-c", textwrap.dedent(f"""
            import socket, time
            sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            while True:
                sock.sendto({lcm_packet("OTHER")!r}, ("{GROUP}", {port}))
                time.sleep(0.02)
            """)])
        self.addCleanup(talker.wait)
        self.addCleanup(talker.kill)
        code, _, err = self.fly()
        self.assertEqual(code, 1)
        self.assertIn("OTHER", err)
        self.assertIn("cure", err)


class Processes(unittest.TestCase):
    def child(self, source, **options):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        child = processes.Child("some", [sys.executable, "-c", textwrap.dedent(source)],
                                pathlib.Path(folder.name) / "some.log", **options)
        self.addCleanup(processes.stop, [child])
        return child

    def test_ready(self):
        self.assertTrue(processes.wait_ready([self.child(SERVICE.format(behaviour=""),
                                                         notifies=True)]))

    def test_silence_is_a_problem(self):
        child = self.child(SERVICE.format(behaviour=""), notifies=True)
        self.assertTrue(processes.wait_ready([child]))
        child._last_sign = time.monotonic() - processes.WATCHDOG_LIMIT - 1
        self.assertIn("no sign of life", child.problem())

    def test_slow_start_is_no_silence(self):
        child = self.child("import time; time.sleep(60)", notifies=True)
        child._last_sign = time.monotonic() - processes.WATCHDOG_LIMIT - 1
        self.assertEqual(child.problem(), "")

    def test_what_does_not_come_up_is_started_once_more(self):
        hang = 'import os, time; "TRIES" in os.environ or time.sleep(60)'
        child = self.child(hang + textwrap.dedent(SERVICE.format(behaviour="")), notifies=True)
        first = child.process.pid
        child._environment["TRIES"] = "1"
        words = io.StringIO()
        with contextlib.redirect_stderr(words):
            child.retry(after=0.0)
            self.assertNotEqual(child.process.pid, first)
            self.assertTrue(processes.wait_ready([child]))
            second = child.process.pid
            child.retry(after=0.0)  # ready
        self.assertEqual(child.process.pid, second)
        self.assertRegex(words.getvalue(), r"some is not ready.*python.*started once more")

    def test_second_hang_is_left_to_the_limit(self):
        child = self.child("import time; time.sleep(60)", notifies=True)
        with contextlib.redirect_stderr(io.StringIO()):
            child.retry(after=0.0)
            second = child.process.pid
            child.retry(after=0.0)
        self.assertEqual(child.process.pid, second)

    def test_what_dies_again_and_again_is_started_ever_later(self):
        child, now = self.child("pass"), 0.0
        self.addCleanup(setattr, time, "monotonic", time.monotonic)
        time.monotonic = lambda: now
        child._started = now
        waits = []
        for _ in range(8):
            child.process.wait()
            died = now
            while not child.mend():
                now += 0.125  # exact in binary
            waits.append(now - died)
        self.assertEqual(waits, [0, 0.5, 1, 2, 4, 4, 4, 4])
        now += processes.SHORT_LIFE + 1.0
        child.process.wait()
        self.assertTrue(child.mend(), "who lived long is back at once")

    def test_signal_is_named(self):
        child = self.child("import os; os.abort()")
        child.process.wait()
        self.assertIn("SIGABRT", child.problem())

    def test_stubborn_child_is_killed(self):
        child = self.child("import signal, time; signal.signal(signal.SIGINT, signal.SIG_IGN)\n"
                           "print('deaf', flush=True); time.sleep(60)")
        while "deaf" not in child.log_tail():
            time.sleep(0.02)
        child.ask_to_stop()
        child.wait_stopped(time.monotonic() + 0.2)
        self.assertEqual(child.process.returncode, -signal.SIGKILL)


class Bus(unittest.TestCase):
    def test_endpoint(self):
        self.assertEqual(bus.endpoint(bus.DEFAULT_URL), (GROUP, 7667))
        for text in ("file://a.lcm", "udpm://239.255.76.67:99999", "udpm://239.255.76.67:0",
                     "udpm://999.1.1.1:7667", "udpm://239.255.76.67:7667777777777?ttl=0"):
            self.assertIsNone(bus.endpoint(text), text)

    def test_address_that_is_not_multicast(self):
        problem = bus.loopback_problem("10.0.0.1", free_port())
        self.assertIn("no multicast address", problem)
        self.assertNotIn("ip route", problem)

    def test_channel_of(self):
        first = b"LC03" + struct.pack(">IIIHH", 1, 9, 0, 0, 2)
        later = b"LC03" + struct.pack(">IIIHH", 1, 9, 5, 1, 2)
        self.assertEqual(bus.channel_of(lcm_packet("POSE")), "POSE")
        self.assertEqual(bus.channel_of(first + b"MAP\0data"), "MAP")
        self.assertEqual(bus.channel_of(later + b"MAP\0data"), "")
        self.assertEqual(bus.channel_of(b"\0"), "")

    def test_loopback(self):
        self.assertEqual(bus.loopback_problem(GROUP, free_port()), "")

    def test_port_in_use(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
            taken.bind(("", 0))
            self.assertIn("taken", bus.loopback_problem(GROUP, taken.getsockname()[1]))


class HostClock(unittest.TestCase):
    """The doctor on the offset that the processes of a host have agreed on."""

    def told(self, text):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "clock"
            if text is not None:
                file.write_text(text, encoding="ascii")
            with unittest.mock.patch.object(doctor, "CLOCK", file):
                return dict(doctor.CHECKS)["host clock"]()

    def test_is_this_machines_within_a_second(self):
        offset = (time.time_ns() - time.monotonic_ns()) // 1000
        for late, verdict in ((0, "ok"), (900_000, "ok"), (-900_000, "ok"), (1_100_000, "warning"), (-1_100_000, "warning")):
            self.assertEqual(self.told(f"{offset + late}\n")[0].lower(), verdict, late)
        self.assertRegex(self.told(f"{offset - 3600 * 10**6}\n")[1], r"-3600\.0 s off .*; cure: systemctl stop .*, then rm ")

    def test_may_be_missing_and_ought_to_be_a_number(self):
        self.assertEqual(self.told(None)[0], doctor.OK)
        self.assertEqual(self.told("soon")[0], doctor.WARNING)


class Devices(unittest.TestCase):
    """The doctor on what the drivers are told to open."""

    def told(self, name, **values):
        values = {"clock": "arrival", "signing_key_file": "", "key_file": "", **values}
        with unittest.mock.patch.object(devices, "parameters", lambda _: values):
            return dict(devices.CHECKS)[name]()

    def test_a_port_that_another_program_holds(self):
        for name, kind, more in (("lidar", socket.SOCK_DGRAM, {"source": "udp"}), ("fcu", socket.SOCK_DGRAM, {"link": "udp"}),
                                 ("link", socket.SOCK_DGRAM, {}), ("viewer", socket.SOCK_STREAM, {})):
            with socket.socket(socket.AF_INET, kind) as other, unittest.mock.patch.object(devices.vehicle, "runs", lambda _: False):
                other.bind(("", 0))
                if kind == socket.SOCK_STREAM:
                    other.listen()
                port = str(other.getsockname()[1])
                verdict, words = self.told(name, port=port, **more)
                self.assertEqual(verdict, "FAILURE", name)
                self.assertRegex(words, f"port {port} is held by another program; cure: ")
                with unittest.mock.patch.object(devices.vehicle, "runs", lambda _: True):
                    self.assertEqual(self.told(name, port=port, **more)[0], "ok", name)
            self.assertEqual(self.told(name, port=port, **more)[0], "ok", name)

    def test_a_device_that_is_not_there_or_not_for_the_units(self):
        for name, key in (("fcu", "link"), ("camera", "source")):
            verdict, words = self.told(name, **{key: "/dev/no_such"})
            self.assertEqual(verdict, devices.WARNING)
            self.assertIn("/dev/no_such is not there; cure: plug it in", words)
            self.assertEqual(self.told(name, **{key: "/dev/null"})[0], "ok")
        with tempfile.NamedTemporaryFile() as file:  # for its owner alone
            verdict, words = devices.device(file.name)
            self.assertEqual(verdict, devices.WARNING)
            self.assertRegex(words, "the units have video and dialout; cure: ")
        self.assertEqual(self.told("camera", source="http://camera/stream")[0], "ok")
        self.assertEqual(self.told("camera", source="no_such.mp4")[0], devices.WARNING)

    def test_the_position_packets_port_counts_with_the_clock_gps(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other, unittest.mock.patch.object(devices.vehicle, "runs", lambda _: False):
            other.bind(("", 0))
            told = {"source": "udp", "port": str(free_port()), "position_port": str(other.getsockname()[1])}
            self.assertEqual(self.told("lidar", **told)[0], "ok")
            verdict, words = self.told("lidar", **told, clock="gps")
            self.assertEqual(verdict, "FAILURE")
            self.assertIn(f"port {told['position_port']} is held by another program", words)

    def test_a_key_that_the_units_cannot_read(self):
        user = unittest.mock.Mock(pw_uid=os.getuid(), pw_gid=os.getgid())
        other = unittest.mock.Mock(pw_uid=os.getuid() + 1, pw_gid=os.getgid() + 1)
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "key"
            for name, key, port in (("fcu", "signing_key_file", {"link": "udp"}), ("link", "key_file", {})):
                told = {**port, "port": str(free_port()), key: str(file)}
                file.unlink(missing_ok=True)
                with unittest.mock.patch.object(devices.pwd, "getpwnam", lambda _: user):
                    self.assertEqual(self.told(name, **told)[0], "FAILURE", "not there")
                    file.write_text("0" * 64, encoding="ascii")
                    file.chmod(0o600)
                    self.assertEqual(self.told(name, **told), ("ok", f"UDP port {told['port']} is free, {file} is there"))
                    file.chmod(0o200)
                    self.assertRegex(self.told(name, **told)[1], "the user chase cannot read it; cure: ")
                with unittest.mock.patch.object(devices.pwd, "getpwnam", lambda _: other):
                    file.chmod(0o604)
                    self.assertEqual(self.told(name, **told)[0], "FAILURE", "its folder is private")
                    pathlib.Path(folder).chmod(0o711)
                    self.assertEqual(self.told(name, **told)[0], "ok")
                    file.chmod(0o600)
                    self.assertEqual(self.told(name, **told)[0], "FAILURE")
                    pathlib.Path(folder).chmod(0o700)

    def test_parameters_are_the_files(self):
        answer = unittest.mock.Mock(stdout='link: "/dev/ttyAMA0"  # udp, or\nport: 14540  # UDP\nrig:  # a\n  x: 1  # m\n')
        with unittest.mock.patch.object(devices.vehicle, "dumped", lambda _: answer):
            self.assertEqual(devices.parameters("fcu"), {"link": "/dev/ttyAMA0", "port": "14540"})
        with unittest.mock.patch.object(devices.vehicle, "dumped", lambda _: unittest.mock.Mock(stdout="")):
            self.assertRegex(devices.checked(devices.fcu)[1], "fcu.yaml is not read; see configuration")


class Results(unittest.TestCase):
    def test_passed_needs_all_criteria(self):
        self.assertTrue(results.passed(PASSED))
        self.assertFalse(results.passed(FAILED))
        self.assertFalse(results.passed({}))

    def test_table(self):
        text = results.table(json.loads(json.dumps(FAILED)))
        self.assertRegex(text, r"safe_ratio +0.9 +FAILED\nin_image_ratio +passed")


if __name__ == "__main__":
    unittest.main()
