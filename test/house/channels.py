"""Checks who listens to what: no ground truth in the loop, no channel that the table does not name, none that no
fault makes late."""

import re
import sys

import tree

LISTENS = {
    "lidar": set(),
    "camera": set(),
    "odometry": {"LIDAR_SCAN", "IMU"},
    "mapping": {"SCAN_REGISTERED", "TARGET"},
    "perception": {"CAMERA_IMAGE", "LIDAR_SCAN", "POSE", "COMMAND", "SELECTION_KEPT"},
    "prediction": {"TARGET", "OBSTACLES"},
    "planning": {"PREDICTION", "OBSTACLES", "UNSEEN", "POSE", "TRACKING", "FLIGHT_STATE", "GEOFENCE",
                 "FCU_STATUS"},
    "control": {"PLAN", "OBSTACLES", "POSE", "FLIGHT_STATE", "GEOFENCE", "FCU_STATUS"},
    "mission": {"COMMAND", "POSE", "OBSTACLES", "TARGET", "PREDICTION", "PLAN", "TRACKING", "ATTITUDE_SETPOINT",
                "HOME", "SELECTION", "LIDAR_STATUS", "CAMERA_STATUS", "ODOMETRY_STATUS", "MAPPING_STATUS",
                "PERCEPTION_STATUS", "PREDICTION_STATUS", "PLANNING_STATUS", "CONTROL_STATUS",
                "FCU_STATUS", "SIMULATOR_STATUS", "RECORDER_STATUS", "MISSION_STATUS", "VIEWER_STATUS",
                "LINK_STATUS"},
    "fcu": {"ATTITUDE_SETPOINT", "POSE", "COMMAND", "FLIGHT_STATE"},
    # FAULT and TRUTH: of logs only, which its node's test asks for.
    "viewer": {"FAULT", "TRUTH", "LIDAR_SCAN", "CAMERA_IMAGE", "IMU", "POSE", "SCAN_REGISTERED", "OBSTACLES", "UNSEEN", "MAP", "LINK_STATUS",
               "TARGET", "PREDICTION", "PLAN", "ATTITUDE_SETPOINT", "TRACKING", "SCENARIO",
               "FLIGHT_STATE", "HOME", "HEALTH", "GEOFENCE", "SELECTION", "SELECTION_KEPT", "COMMAND", "COMMAND_ACK", "MISSION_STATUS", "LIDAR_STATUS", "CAMERA_STATUS", "ODOMETRY_STATUS", "MAPPING_STATUS",
               "PERCEPTION_STATUS", "PREDICTION_STATUS", "PLANNING_STATUS", "CONTROL_STATUS",
               "FCU_STATUS", "SIMULATOR_STATUS", "RECORDER_STATUS",
               "VIEWER_STATUS"},
    "simulator": {"ATTITUDE_SETPOINT", "POSE"},  # in place of fcu
}
# What a flight in lockstep hears hardly ever, or as it was before: nothing of it is late by 300 ms.
SELDOM = {"COMMAND", "HOME", "GEOFENCE", "SELECTION", "SELECTION_KEPT"}
ON_BOARD = ("odometry", "mapping", "perception", "prediction", "planning", "control", "mission", "simulator")
DELAYED = re.compile(r'\{"([A-Z_]+)", Needs::')
SUBSCRIBE = re.compile(r'Subscribe<[\w:]+>\(\s*(?:/\*.*?\*/\s*)?([^,]+),')


def subscriptions(service):
    for path in tree.files(f"services/{service}/*.h", f"services/{service}/*.cpp"):
        for argument in SUBSCRIBE.findall(tree.text(path)):
            yield path, argument.strip()


def check(service):
    heard = set()
    for path, argument in subscriptions(service):
        channel = argument.strip('"')
        heard.add(channel)
        if not re.fullmatch(r'"\w+"', argument):
            yield f"{path}: subscribes to {argument}: spell the channel where it is subscribed to"
        elif channel not in LISTENS[service]:
            yield f"{path}: listens to {channel}, which is not for {service}"
    for channel in sorted(LISTENS[service] - heard):
        yield f"services/{service}: does not listen to {channel}"


def services():
    return sorted({path.parts[1] for path in tree.files("services/*.cpp")})


def without_delay():
    delayed = set(DELAYED.findall(tree.text("common/world/fault.cpp")))
    for channel in sorted(set().union(*(LISTENS[service] for service in ON_BOARD)) - delayed - SELDOM):
        if not channel.endswith("_STATUS"):
            yield f"common/world/fault.cpp: no fault delays {channel}"


def main():
    problems = list(without_delay())
    problems += [p for service in LISTENS for p in check(service)]
    problems += [f"{path}: listens to {argument}, and LISTENS does not know {service}" for service in services()
                 if service not in LISTENS for path, argument in subscriptions(service)]
    for path in tree.files("services/*.h", "services/*.cpp", "common/*.cpp"):
        # logs, bus: what any message looks like; bus: where the launcher sets CHASE_BUS_FAULTS the live one hears FAULT, and
        # then delays and loses messages itself.
        if path.parts[1] not in ("simulator", "bus", "logs", "viewer"):
            problems += [f"{path}: knows {kind}: it stays out of the loop"
                         for kind in ("truth_t", "event_t") if kind in tree.text(path)]
    return tree.report(problems)


if __name__ == "__main__":
    sys.exit(main())
