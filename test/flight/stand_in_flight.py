#!/usr/bin/env -S python3 -I -S
"""A stand-in for chase-flight in tests of chase-campaign: the seed says what becomes of the flight, within
milliseconds. It appends its arguments to $STAND_IN_CALLS and sleeps for $STAND_IN_SLEEP seconds."""

import json
import os
import pathlib
import random
import signal
import sys
import time


def option(name, default=None):
    return sys.argv[sys.argv.index(name) + 1] if name in sys.argv else default


def metrics(seed, fault):
    rng = random.Random(f"{seed} {fault} {pathlib.Path(sys.argv[1]).read_text()}")
    m = {"scenario": "stand-in", "seed": seed, "fault": fault, "fault_time_s": -1.0, "duration_s": 60.0,
         "flown_s": min(60.0, float(option("--until", 60))), "passed": True, "safe_ratio": 1.0,
         "min_clearance_m": 0.2 + 0.1 * rng.random(), "visible_ratio": 0.99, "in_image_ratio": 1.0,
         "travel_ratio": 1.02, "certificate_kept_ratio": 0.98, "nonfinite_setpoints": 0,
         "plans_in_air": 1000, "uncertified_brakes": seed, "accelerating_brakes": 0,
         "reaction_s": None, "recovery_s": None, "faults": [],
         "distance_ratio": 1.0 + 0.1 * rng.random(), "distance_error": 0.05 + 0.01 * rng.random(),
         "odometry_ate_m": 0.01 * rng.random(), "collision_s": -1.0, "collided_with": "",
         "plan_ms": {"mean": time.perf_counter()}, "cpu_s": {"planning": time.perf_counter()},
         "real_time_factor": time.perf_counter()}
    if seed % 10 == 1:
        m.update(safe_ratio=0.99, collision_s=12.25, collided_with="cylinder 3", min_clearance_m=-0.01)
        if "--end-on-collision" in sys.argv:
            m["flown_s"] = 12.25
    if seed % 10 == 2:
        m.update(visible_ratio=0.83)
    if seed % 10 == 3:
        m.update(odometry_ate_m=3.25, visible_ratio=0.4)
    if fault:
        never = seed % 10 == 3
        m.update(reaction_s=0.01 * seed, recovery_s=None if never else 0.5 + 0.1 * seed,
                 nonfinite_setpoints=seed)
        m["faults"] = [{"name": fault, "at_s": 5.0, "end_s": 5.5, "input": "PLAN",
                        "reaction_s": m["reaction_s"], "recovery_s": m["recovery_s"]}]
    m["criteria"] = {"complete": m["flown_s"] > 59.9, "safe_ratio": m["safe_ratio"] >= 1,
                     "visible_ratio": m["visible_ratio"] >= 0.95, "real_time_factor": False}
    m["passed"] = all(m["criteria"].values())
    return m


def main():
    time.sleep(float(os.environ.get("STAND_IN_SLEEP", 0)))
    if calls := os.environ.get("STAND_IN_CALLS"):
        with open(calls, "a", encoding="ascii") as file:
            file.write(" ".join(sys.argv[1:]) + "\n")
    seed, fault = int(option("--seed")), option("--fault", "")
    if seed == 14:
        os.kill(os.getpid(), signal.SIGSEGV)
    if seed == 24:
        os.kill(os.getpid(), signal.SIGTERM)
    if seed == 15:
        print("chase-flight: no luck today; cure: another seed", file=sys.stderr)
        sys.exit(1)
    if path := option("--log"):
        pathlib.Path(path).write_text(f"log of seed {seed}", encoding="ascii")
    text = json.dumps(metrics(seed, fault))
    if seed == 16:
        text = text[:100]
    if seed == 17:
        text = "{}"
    if seed == 18:
        return
    print("criteria FAILED")
    if path := option("--metrics"):
        pathlib.Path(path).write_text(text, encoding="ascii")


main()
