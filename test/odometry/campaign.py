#!/usr/bin/env python3
"""Takes odometry's figures in the simulator and prints them as a table.

campaign.py BUILD_DIR [--only PART...] [--first SEED]

Each part flies its courses once per seed, keeps what the sensors say, replays it through
chase-odometry and compares POSE with TRUTH. Parts: gym, forest, aggressive, faults, still,
consistency, memory, flight (the closed loop of chase-flight). About twenty minutes for all."""

import argparse
import json
import pathlib
import random
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "deploy/launcher"))
sys.dont_write_bytecode = True
import version  # noqa: E402

SCENARIOS = ROOT / "deploy" / "scenarios"
FAULT_AT = 20.0  # mission time, s
FAULTS = {"no_sweeps": 1.0, "no_imu": 0.3, "corridor": 3.0, "dropped": 3.0, "nan": 0.1,
          "stamps": 1.0}
# 0.5 % and 99.5 % quantiles of the mean of ten chi-square variables of 3 and of 1 degree of freedom.
BAND_POSITION, BAND_YAW = (1.379, 5.367), (0.2156, 2.519)


class Campaign:
    def __init__(self, build, folder, first):
        self.first = first
        self.bin, self.trial = build / "bin", build / "test" / "odometry_trial"
        self.folder = folder
        self.missed = []

    def run(self, *command):
        answer = subprocess.run([str(c) for c in command], capture_output=True, text=True,
                                check=False)
        if answer.returncode not in (0, 2):
            raise RuntimeError(f"{command[0]}: {answer.stderr.strip()[-300:]}")
        return answer.stdout

    def config(self, world):
        path = self.folder / f"{world}.yaml"
        if not path.exists():
            path.write_text(self.run(self.bin / "chase-flight", SCENARIOS / f"{world}.yaml",
                                     "--print-config", "odometry"), encoding="utf-8")
        return path

    def calibrated(self, world, seed):
        """The same, the attitude of the LiDAR as a careful calibration leaves it: 0.1 degrees off."""
        draw = random.Random(seed)
        angles = ", ".join(f"{draw.gauss(0.0, 0.1):.4f}" for _ in range(3))
        text, found = re.subn(r"lidar_rpy_deg: \[0, 0, 0\]", f"lidar_rpy_deg: [{angles}]",
                              self.config(world).read_text(encoding="utf-8"))
        if found != 1:
            raise RuntimeError(f"{world}: the rig's lidar_rpy_deg is not 0")
        path = self.folder / "calibrated.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    def fly(self, world, course, seed, *options, judge=(), config=None):
        """Figures of one flight."""
        sensors, poses = self.folder / "sensors.lcm", self.folder / "poses.lcm"
        self.run(self.trial, "record", SCENARIOS / f"{world}.yaml", sensors, "--course", course,
                 "--seed", seed, *options)
        self.run(self.bin / "chase-odometry", "--config", config or self.config(world), "--replay",
                 sensors, "--out", poses)
        figures = json.loads(self.run(self.trial, "judge", sensors, poses, *judge))
        sensors.unlink()
        poses.unlink()
        return figures

    def row(self, what, figures, met):
        print(f"| {what} | {figures} | {'met' if met else 'MISSED'} |", flush=True)
        if not met:
            self.missed.append(what)

    def gym(self):
        for seed in range(self.first, self.first + 5):
            f = self.fly("gym", "follow", seed)
            self.row(f"gym, 60 s, seed {seed}",
                     f"ATE {1e3 * f['ate_m']:.0f} mm, end z {1e3 * f['end_z_m']:.0f} mm, velocity "
                     f"{f['velocity_rms']:.3f} m/s",
                     f["ate_m"] <= 0.03 and abs(f["end_z_m"]) <= 0.02 and f["velocity_rms"] <= 0.06)

    def flight(self):
        for seed in range(self.first, self.first + 5):
            log = self.folder / "flight.lcm"
            self.run(self.bin / "chase-flight", SCENARIOS / "gym.yaml", "--seed", seed, "--quiet",
                     "--log", log)
            f = json.loads(self.run(self.trial, "judge", log, log))
            log.unlink()
            self.row(f"gym, chase-flight, seed {seed}",
                     f"ATE {1e3 * f['ate_m']:.0f} mm, end z {1e3 * f['end_z_m']:.0f} mm, velocity "
                     f"{f['velocity_rms']:.3f} m/s",
                     f["ate_m"] <= 0.03 and abs(f["end_z_m"]) <= 0.02 and f["velocity_rms"] <= 0.06)

    def forest(self):
        for seed in range(self.first, self.first + 5):
            f = self.fly("forest", "follow", seed)
            self.row(f"forest, 53 s at 3 m/s, gusts, seed {seed}",
                     f"ATE {1e3 * f['ate_m']:.0f} mm, yaw at the end {f['yaw_end_deg']:.2f} deg",
                     f["ate_m"] <= 0.10 and abs(f["yaw_end_deg"]) <= 0.5)

    def aggressive(self):
        for world in ("gym", "forest"):
            for seed in (1, 2):
                f = self.fly(world, "aggressive", seed, "--until", 30)
                self.row(f"aggressive, {world}, 30 s, seed {seed}",
                         f"ATE {1e3 * f['ate_m']:.0f} mm, worst {1e3 * f['worst_m']:.0f} mm, lost "
                         f"{f['lost']} samples", f["ate_m"] <= 0.10 and f["lost"] == 0)

    def faults(self):
        for fault, length in FAULTS.items():
            f = self.fly("gym", "follow", 1, "--until", 30, "--fault", fault, "--at", FAULT_AT,
                         judge=("--fault-at", FAULT_AT, "--fault-length", length))
            said, well = f["said_after_s"], f["well_after_s"]
            self.row(f"fault: {fault}, {length} s",
                     f"said after {said:.2f} s, well {well:.2f} s after its end, worst "
                     f"{1e3 * f['worst_from_fault_m']:.0f} mm, largest step of the error "
                     f"{1e3 * f['largest_step_m']:.1f} mm",
                     f["not_finite"] == 0 and 0.0 <= said <= 0.2 and 0.0 <= well <= 1.0
                     and f["worst_from_fault_m"] <= 0.3)

    def still(self):
        for course in ("rest", "hover"):
            f = self.fly("gym", course, 1, "--until", 60)
            self.row(f"standing still 60 s ({course})", f"drift {1e3 * f['drift_m']:.1f} mm",
                     f["drift_m"] <= 0.005 or course != "rest")

    def consistency(self):
        for world in ("gym", "forest"):
            seeds = range(self.first, self.first + 10)
            runs = [self.fly(world, "follow", seed, config=self.calibrated(world, seed))["nees"]
                    for seed in seeds]
            n = min(len(run) for run in runs)
            for column, name, band in ((1, "position", BAND_POSITION), (2, "yaw", BAND_YAW)):
                means = [sum(run[k][column] for run in runs) / len(runs) for k in range(n)]
                inside = sum(band[0] <= m <= band[1] for m in means) / n
                mean = sum(means) / n
                self.row(f"NEES of {name}, {world}, 10 seeds",
                         f"mean {mean:.2f} (band {band[0]:.2f} to {band[1]:.2f}), inside for "
                         f"{100 * inside:.0f} % of the seconds", band[0] <= mean <= band[1])

    def memory(self):
        out = self.run(self.trial, "endure", SCENARIOS / "forest.yaml", "--minutes", 30)
        sizes = [float(line.split()[3]) for line in out.splitlines()]
        self.row("memory, 30 minutes to and fro in the forest",
                 f"process {sizes[0]:.0f} MB at the start, {sizes[10]:.0f} MB after 10, "
                 f"{sizes[-1]:.0f} MB after 30 minutes", sizes[-1] <= 1.05 * sizes[10])


def main():
    parts = ["gym", "flight", "forest", "aggressive", "faults", "still", "consistency", "memory"]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--version", action="version", version=version.text())
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--only", nargs="+", choices=parts, default=parts)
    parser.add_argument("--first", type=int, default=1, help="seed; five or ten from it are flown")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        campaign = Campaign(arguments.build.resolve(), pathlib.Path(folder), arguments.first)
        print("| what | figures | |\n| --- | --- | --- |")
        for part in arguments.only:
            getattr(campaign, part)()
    return 1 if campaign.missed else 0


if __name__ == "__main__":
    sys.exit(main())
