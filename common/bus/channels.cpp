#include "common/bus/channels.h"

#include <algorithm>
#include <cctype>

namespace chase::bus {

const std::vector<ChannelRow>& ChannelTable() {
  static const std::vector<ChannelRow> table = {
      {"LIDAR_SCAN", "lidar_scan_t", "lidar, simulator", true},
      {"CAMERA_IMAGE", "camera_image_t", "camera, simulator", true},
      {"IMU", "imu_t", "fcu, simulator", false},
      {"POSE", "pose_t", "odometry", false},
      {"SCAN_REGISTERED", "scan_registered_t", "odometry", true},
      {"OBSTACLES", "obstacles_t", "mapping", false},
      {"UNSEEN", "obstacles_t", "mapping", false},
      {"MAP", "map_t", "mapping", true},
      {"TARGET", "target_t", "perception", false},
      {"SELECTION", "selection_t", "perception", false, true},
      {"SELECTION_KEPT", "selection_t", "mission", false, true},
      {"PREDICTION", "prediction_t", "prediction", false},
      {"PLAN", "plan_t", "planning", false, true},
      {"ATTITUDE_SETPOINT", "attitude_setpoint_t", "control", false, true},
      {"TRACKING", "tracking_t", "control", false},
      {"COMMAND", "command_t", "command, viewer", false, true},
      {"COMMAND_ACK", "command_ack_t", "mission, perception", false},
      {"FLIGHT_STATE", "flight_state_t", "mission", false, true},
      {"HOME", "flight_state_t", "control", false, true},
      {"HEALTH", "health_t", "mission", false},
      {"GEOFENCE", "geofence_t", "mission", false, true},
      {"TRUTH", "truth_t", "simulator", false},
      {"SCENARIO", "scenario_t", "simulator", false},
      {"FAULT", "event_t", "simulator, chase-flight, flight-monitor", false},
  };
  return table;
}

namespace {

/// Is `name` one of a list with commas?
bool IsAmong(const std::string& list, const std::string& name) {
  return (", " + list + ",").find(", " + name + ",") != std::string::npos;
}

}  // namespace

bool MaySend(const std::string& channel, const std::string& sender) {
  for (const auto& row : ChannelTable())
    if (row.commands && row.channel == channel) return IsAmong(row.sender, sender);
  return true;
}

bool IsHeavy(const std::string& channel) {
  for (const auto& row : ChannelTable())
    if (row.channel == channel) return row.heavy;
  return false;
}

std::string StatusChannel(const std::string& process) {
  std::string name = process;
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return name + "_STATUS";
}

}  // namespace chase::bus
