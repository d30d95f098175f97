#!/usr/bin/env python3
"""Golden replays: a service driven by a short recorded input must send what it sent when the golden was
made.

Usage: golden.py check BIN_DIR SCENARIO GOLDEN
       golden.py record BIN_DIR SCENARIO frozen|FLIGHT.lcm GOLDEN...   (prints what changed)

`frozen` records the output alone, of the input that is there. A flight gives a golden that is not there yet its
input; one that is there keeps its own.

Inputs are slices of a flight of chase-flight with sweeps thinned to some columns of a sweep, so that the
files stay small. The configuration is today's for the scenario: a new default shows up as a difference.
"""
import collections
import lzma
import pathlib
import struct
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).parent))
sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "deploy/launcher"))
sys.dont_write_bytecode = True
import lcmlog  # noqa: E402
import script  # noqa: E402

GOLDEN = pathlib.Path(__file__).resolve().parents[2] / "logs" / "golden"
TOLERANCE = "1e-6"  # relative; another processor's mathematics library may round differently

# golden, which begins with its service: inputs, outputs, from and to [s of the flight's clock], one of how many columns
# is kept
SLICES = {
    "odometry": (["LIDAR_SCAN", "IMU"], ["POSE", "SCAN_REGISTERED"], 1.0, 3.4, 8),
    "mapping": (["SCAN_REGISTERED", "TARGET"], ["OBSTACLES"], 20.0, 21.6, 6),
    "perception": (["CAMERA_IMAGE", "LIDAR_SCAN", "POSE"], ["TARGET"], 20.0, 20.35, 4),
    "prediction": (["TARGET", "OBSTACLES"], ["PREDICTION"], 20.0, 25.0, 1),
    "planning": (["PREDICTION", "OBSTACLES", "POSE", "TRACKING"], ["PLAN"], 20.0, 23.0, 1),
    "control": (["PLAN", "OBSTACLES", "POSE"], ["ATTITUDE_SETPOINT"], 20.0, 22.0, 1),
    "simulator": (["ATTITUDE_SETPOINT"], ["TRUTH", "IMU"], 1.0, 5.0, 1),
    # The sweeps stop at 20.6 s and come again at 21.6 s: it brakes, and flies on.
    "planning_lidar_gap": (["PREDICTION", "OBSTACLES", "POSE", "TRACKING"], ["PLAN"], 20.4, 23.2, 1),
    "mapping_forest": (["SCAN_REGISTERED", "TARGET"], ["OBSTACLES"], 20.0, 21.6, 6),
    # A whole mission: take-off, chase, hold, return, landing.
    "mission": (["COMMAND", "POSE", "TRACKING", "TARGET", "OBSTACLES", "PLAN", "ATTITUDE_SETPOINT", "FCU_STATUS",
                 "CONTROL_STATUS", "MAPPING_STATUS", "ODOMETRY_STATUS", "PERCEPTION_STATUS", "PLANNING_STATUS",
                 "PREDICTION_STATUS", "SIMULATOR_STATUS"], ["FLIGHT_STATE", "COMMAND_ACK"], 0.0, 50.0, 1),
}
# One of how many messages is kept, where that does.
EVERY = {"mission": {"POSE": 20, "ATTITUDE_SETPOINT": 20, "OBSTACLES": 2, "PLAN": 4}}
LARGEST = 2e6  # bytes of a file that is committed
# Bytes between a cloud's head and its size, and how many float and byte arrays follow.
CLOUDS = {"LIDAR_SCAN": (0, 4, 2), "SCAN_REGISTERED": (61, 3, 2)}


def thin(channel, data, step):
    """Keeps every step-th group of 16 points, which is a column of a sweep."""
    if channel not in CLOUDS or step == 1:
        return data
    offset, n_float, n_byte = CLOUDS[channel]
    at = lcmlog.after_head(data) + offset
    size, = struct.unpack_from(">i", data, at)
    keep = [i for i in range(size) if i // 16 % step == 0]
    out, pos = data[:at] + struct.pack(">i", len(keep)), at + 4
    for width in [4] * n_float + [1] * n_byte:
        out += b"".join(data[pos + width * i:pos + width * (i + 1)] for i in keep)
        pos += width * size
    return out


def run_service(bin_dir, scenario, golden, source, folder):
    """Replays `source`; returns the events of the golden's channels."""
    service = golden.partition("_")[0]
    text = subprocess.run([f"{bin_dir}/chase-flight", scenario, "--print-config", service],
                          check=True, capture_output=True, text=True).stdout
    config, out = f"{folder}/config.yaml", f"{folder}/out.lcm"
    pathlib.Path(config).write_text(text)
    subprocess.run([f"{bin_dir}/chase-{service}", "--config", config, "--replay", source, "--out", out],
                   check=True)
    outputs = SLICES[golden][1]
    return [(t, c, thin(c, d, 40)) for t, c, d in lcmlog.read(out) if c in outputs]


def unpack(name, folder):
    path = f"{folder}/{name}"
    pathlib.Path(path).write_bytes(lzma.decompress((GOLDEN / f"{name}.xz").read_bytes()))
    return path


def difference(bin_dir, a, b):
    return subprocess.run([f"{bin_dir}/chase-log", "diff", a, b, "--tolerance", TOLERANCE],
                          capture_output=True, text=True)


def check(bin_dir, scenario, golden):
    with tempfile.TemporaryDirectory() as folder:
        source, expected = unpack(f"{golden}.in.lcm", folder), unpack(f"{golden}.out.lcm", folder)
        events = run_service(bin_dir, scenario, golden, source, folder)
        if not events:
            sys.exit(f"{golden}: the replay gave nothing")
        lcmlog.write(f"{folder}/now.lcm", events)
        result = difference(bin_dir, expected, f"{folder}/now.lcm")
        if result.returncode or "only in" in result.stdout:
            sys.exit(f"{golden} differs from its golden:\n{result.stdout}{result.stderr}"
                     "If that is meant, record it anew: test/replay/golden.py record ... frozen ...")
        print(f"{golden}: {len(events)} messages as in the golden")


def take_input(flight, golden, source):
    """The golden's slice of a flight."""
    inputs, _, begin, end, step = SLICES[golden]
    every, seen = EVERY.get(golden, {}), collections.Counter()

    def is_kept(channel):
        seen[channel] += 1
        return seen[channel] % every.get(channel, 1) == 0

    if (GOLDEN / f"{golden}.in.lcm.xz").exists():
        sys.exit(f"golden.py: the input of {golden} is frozen: give frozen in place of {flight}")
    events = [(t, c, thin(c, d, step)) for t, c, d in lcmlog.read(flight)
              if c in inputs and begin <= t * 1e-6 < end and is_kept(c)]
    if not events:
        sys.exit(f"golden.py: {flight}: holds no {', '.join(inputs)} from {begin} to {end} s; "
                 "fly 30 s or more, with --log")
    lcmlog.write(source, events)


def pack(path, name):
    packed = lzma.compress(pathlib.Path(path).read_bytes(), preset=9)
    if len(packed) > LARGEST:
        sys.exit(f"golden.py: {name} is {len(packed) // 1024} KiB, more than is committed; take a shorter slice")
    (GOLDEN / name).write_bytes(packed)
    print(f"{name}: {len(packed) // 1024} KiB")


def record(bin_dir, scenario, flight, *goldens):
    GOLDEN.mkdir(exist_ok=True)
    for golden in goldens:
        with tempfile.TemporaryDirectory() as folder:
            source = f"{folder}/{golden}.in.lcm"
            if flight == "frozen":
                unpack(f"{golden}.in.lcm", folder)
            else:
                take_input(flight, golden, source)
            lcmlog.write(f"{folder}/new.lcm", run_service(bin_dir, scenario, golden, source, folder))
            if (GOLDEN / f"{golden}.out.lcm.xz").exists():
                print(difference(bin_dir, unpack(f"{golden}.out.lcm", folder),
                                 f"{folder}/new.lcm").stdout)
            if flight != "frozen":
                pack(source, f"{golden}.in.lcm.xz")
            pack(f"{folder}/new.lcm", f"{golden}.out.lcm.xz")


def refuse(why):
    sys.exit(f"golden.py: {why}; usage: golden.py check BIN_DIR SCENARIO GOLDEN, or "
             "golden.py record BIN_DIR SCENARIO frozen|FLIGHT.lcm GOLDEN...")


def main(arguments):
    if not arguments or arguments[0] not in ("check", "record"):
        refuse(f"'{' '.join(arguments[:1])}' is neither check nor record")
    command, rest = arguments[0], arguments[1:]
    if len(rest) < (3 if command == "check" else 4) or (command == "check" and len(rest) > 3):
        refuse(f"{command} with {len(rest)} arguments")
    for golden in rest[2:3] if command == "check" else rest[3:]:
        if golden not in SLICES:
            refuse(f"no golden '{golden}'; there are {', '.join(SLICES)}")
    try:
        (check if command == "check" else record)(*rest)
    except subprocess.CalledProcessError as error:
        said = (error.stderr or "").strip()
        sys.exit(f"golden.py: {pathlib.Path(error.cmd[0]).name} failed: {said or 'see above'}")
    except OSError as error:
        sys.exit(f"golden.py: {error.filename}: {error.strerror}")
    except (ValueError, lzma.LZMAError) as error:
        sys.exit(f"golden.py: {error}")


if __name__ == "__main__":
    main(script.arguments(__doc__, 0))
