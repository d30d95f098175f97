#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/command_t.hpp"
#include "chase/obstacles_t.hpp"
#include "chase/plan_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/prediction_t.hpp"
#include "chase/selection_t.hpp"
#include "chase/status_t.hpp"
#include "chase/target_t.hpp"
#include "chase/tracking_t.hpp"
#include "common/bus/autopilot_state.h"
#include "common/bus/bus.h"
#include "common/bus/node.h"
#include "services/mission/mission.h"

namespace chase::mission {

/// COMMAND, POSE, OBSTACLES, TARGET, PREDICTION, PLAN, TRACKING, ATTITUDE_SETPOINT, HOME, SELECTION
/// and statuses in; FLIGHT_STATE, COMMAND_ACK, HEALTH, GEOFENCE and SELECTION_KEPT out. Ticks are
/// the clock.
class MissionNode : public bus::Node {
 public:
  MissionNode(bus::Bus& bus, const MissionConfig& config);
  int64_t TickPeriod() const override { return kTick; }
  void Tick(int64_t utime) override;
  bus::NodeReport Report() const override;

 private:
  static constexpr int64_t kTick = 100'000;  // us
  void SubscribeStatuses();
  void OnCommand(const command_t& message);
  void OnPose(const pose_t& message);
  void OnObstacles(const obstacles_t& message);
  void OnPlan(const plan_t& message);
  void OnTracking(const tracking_t& message);
  void OnStatus(const status_t& message);
  void SendState();
  void SendHealth();
  bool CameBackBefore(const std::string& name, const ProcessReport& report) const;
  void SendSelection();
  void SendGeofence();
  double Now() const;
  double Seconds(int64_t utime) const;

  bus::Bus& bus_;
  MissionConfig config_;
  int64_t origin_;  // utime that the core's seconds count from: the start of the process
  Mission mission_;
  bus::AutopilotState autopilot_;
  std::optional<selection_t> selection_;  // perception's newest
  /// Since when a mission process before this one led the flight as it did last, us.
  std::optional<int64_t> led_before_;
  int64_t ticks_ = 0;
};

}  // namespace chase::mission
