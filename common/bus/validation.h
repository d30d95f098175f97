#pragma once

#include <string>

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

namespace chase::bus {

/// What makes a decoded message unusable (a number that is not finite, sizes that disagree), or an
/// empty string. Clouds may hold single points that are not finite; nodes leave those out.
std::string Problem(const attitude_setpoint_t& m);
std::string Problem(const camera_image_t& m);
std::string Problem(const command_ack_t& m);
std::string Problem(const command_t& m);
std::string Problem(const event_t& m);
std::string Problem(const flight_state_t& m);
std::string Problem(const geofence_t& m);
std::string Problem(const health_t& m);
std::string Problem(const imu_t& m);
std::string Problem(const lidar_scan_t& m);
std::string Problem(const map_t& m);
std::string Problem(const obstacles_t& m);
std::string Problem(const plan_t& m);
std::string Problem(const pose_t& m);
std::string Problem(const prediction_t& m);
std::string Problem(const scan_registered_t& m);
std::string Problem(const scenario_t& m);
std::string Problem(const selection_t& m);
std::string Problem(const status_t& m);
std::string Problem(const target_t& m);
std::string Problem(const tracking_t& m);
std::string Problem(const truth_t& m);

}  // namespace chase::bus
