#!/usr/bin/env python3
"""A process that checks its way to itself at its start leaves no message to loggers and spies. In a network
namespace of its own: bus_loopback_test.py BIN_DIR"""

import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path[:0] = [str(ROOT / "deploy/launcher"), str(ROOT / "test/replay")]
import bus  # noqa: E402
import lcmlog  # noqa: E402

GROUP, PORT = "239.255.76.67", 7667
URL = f"udpm://{GROUP}:{PORT}?ttl=0"


def main(binaries):
    with tempfile.TemporaryDirectory() as folder, bus.listener(GROUP, PORT) as wire:
        log = pathlib.Path(folder) / "all.lcm"
        env = {**os.environ, "LCM_DEFAULT_URL": URL}
        logger = subprocess.Popen(["lcm-logger", "-q", log], env=env)
        time.sleep(0.5)
        assert bus.loopback_problem(GROUP, PORT) == ""
        service = subprocess.Popen([binaries / "chase-prediction"], env=env)
        packets = list(bus.packets(wire, time.monotonic() + 3.0))
        for process in (service, logger):
            process.send_signal(signal.SIGINT)
            process.wait(10)
        logged = {channel for _, channel, _ in lcmlog.read(log)}
    checks = [p for p in packets if b"loopback" in p.lower()]
    assert len(checks) >= 2, "neither process has checked its way"
    heard = {bus.channel_of(p) for p in packets} - {""}
    assert "PREDICTION_STATUS" in heard & logged, (heard, logged)
    strange = {name for name in heard | logged if "LOOPBACK" in name.upper()}
    assert not strange, strange
    print(f"{len(checks)} checks, channels of log and wire: {', '.join(sorted(heard | logged))}")


main(pathlib.Path(sys.argv[1]).resolve())
