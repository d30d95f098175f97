#pragma once

#include <string>
#include <string_view>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/camera_image_t.hpp"
#include "chase/command_ack_t.hpp"
#include "chase/command_t.hpp"
#include "chase/event_t.hpp"
#include "chase/flight_state_t.hpp"
#include "chase/geofence_t.hpp"
#include "chase/health_t.hpp"
#include "chase/imu_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "chase/map_t.hpp"
#include "chase/obstacles_t.hpp"
#include "chase/plan_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/prediction_t.hpp"
#include "chase/scan_registered_t.hpp"
#include "chase/scenario_t.hpp"
#include "chase/selection_t.hpp"
#include "chase/status_t.hpp"
#include "chase/target_t.hpp"
#include "chase/tracking_t.hpp"
#include "chase/truth_t.hpp"
#include "common/bus/bus.h"

namespace chase::viewer {

/// Pages are told all that is shown, but for what has the form of obstacles or of mission's word
/// and is none: places that nothing was seen of, and the take-off place that control remembers.
inline bool IsOnPage(std::string_view channel) { return channel != "UNSEEN" && channel != "HOME"; }

/// Hands every good message of the channels that pages and Foxglove show to `hear(channel,
/// message)`.
template <class Hear>
void SubscribeShown(bus::Bus& bus, const Hear& hear) {
  const auto on = [&hear](const char* channel) {
    return [hear, channel](const auto& m) { hear(channel, m); };
  };
  bus.Subscribe<pose_t>("POSE", on("POSE"));
  bus.Subscribe<target_t>("TARGET", on("TARGET"));
  bus.Subscribe<plan_t>("PLAN", on("PLAN"));
  bus.Subscribe<prediction_t>("PREDICTION", on("PREDICTION"));
  bus.Subscribe<obstacles_t>("OBSTACLES", on("OBSTACLES"));
  bus.Subscribe<obstacles_t>("UNSEEN", on("UNSEEN"));
  bus.Subscribe<tracking_t>("TRACKING", on("TRACKING"));
  bus.Subscribe<scan_registered_t>("SCAN_REGISTERED", on("SCAN_REGISTERED"));
  bus.Subscribe<camera_image_t>("CAMERA_IMAGE", on("CAMERA_IMAGE"));
  bus.Subscribe<flight_state_t>("FLIGHT_STATE", on("FLIGHT_STATE"));
  bus.Subscribe<flight_state_t>("HOME", on("HOME"));
  bus.Subscribe<command_ack_t>("COMMAND_ACK", on("COMMAND_ACK"));
  bus.Subscribe<geofence_t>("GEOFENCE", on("GEOFENCE"));
  bus.Subscribe<health_t>("HEALTH", on("HEALTH"));
  bus.Subscribe<selection_t>("SELECTION", on("SELECTION"));
  bus.Subscribe<selection_t>("SELECTION_KEPT", on("SELECTION_KEPT"));
  bus.Subscribe<imu_t>("IMU", on("IMU"));
  bus.Subscribe<lidar_scan_t>("LIDAR_SCAN", on("LIDAR_SCAN"));
  bus.Subscribe<map_t>("MAP", on("MAP"));
  bus.Subscribe<attitude_setpoint_t>("ATTITUDE_SETPOINT", on("ATTITUDE_SETPOINT"));
  bus.Subscribe<command_t>("COMMAND", on("COMMAND"));
  bus.Subscribe<scenario_t>("SCENARIO", on("SCENARIO"));
  bus.Subscribe<status_t>("LIDAR_STATUS", on("LIDAR_STATUS"));
  bus.Subscribe<status_t>("CAMERA_STATUS", on("CAMERA_STATUS"));
  bus.Subscribe<status_t>("ODOMETRY_STATUS", on("ODOMETRY_STATUS"));
  bus.Subscribe<status_t>("MAPPING_STATUS", on("MAPPING_STATUS"));
  bus.Subscribe<status_t>("PERCEPTION_STATUS", on("PERCEPTION_STATUS"));
  bus.Subscribe<status_t>("PREDICTION_STATUS", on("PREDICTION_STATUS"));
  bus.Subscribe<status_t>("PLANNING_STATUS", on("PLANNING_STATUS"));
  bus.Subscribe<status_t>("CONTROL_STATUS", on("CONTROL_STATUS"));
  bus.Subscribe<status_t>("MISSION_STATUS", on("MISSION_STATUS"));
  bus.Subscribe<status_t>("FCU_STATUS", on("FCU_STATUS"));
  bus.Subscribe<status_t>("SIMULATOR_STATUS", on("SIMULATOR_STATUS"));
  bus.Subscribe<status_t>("RECORDER_STATUS", on("RECORDER_STATUS"));
  bus.Subscribe<status_t>("LINK_STATUS", on("LINK_STATUS"));
  bus.Subscribe<status_t>("VIEWER_STATUS", on("VIEWER_STATUS"));
}

/// The same of what no vehicle knows: the faults that a test flight did to itself, and where the
/// simulator had everybody; for logs.
template <class Hear>
void SubscribeUnknown(bus::Bus& bus, const Hear& hear) {
  bus.Subscribe<event_t>("FAULT", [hear](const event_t& m) { hear("FAULT", m); });
  bus.Subscribe<truth_t>("TRUTH", [hear](const truth_t& m) { hear("TRUTH", m); });
}

}  // namespace chase::viewer
