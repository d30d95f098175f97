#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "chase/flight_state_t.hpp"
#include "chase/geofence_t.hpp"
#include "chase/obstacles_t.hpp"
#include "chase/plan_t.hpp"
#include "chase/pose_t.hpp"
#include "common/bus/autopilot_state.h"
#include "common/bus/bus.h"
#include "common/bus/epoch.h"
#include "common/bus/node.h"
#include "common/bus/stamp_order.h"
#include "common/world/plan_check.h"
#include "services/control/controller.h"
#include "services/control/pose_age.h"

namespace chase::control {

/// PLAN, OBSTACLES, FLIGHT_STATE, GEOFENCE, FCU_STATUS and POSE in, ATTITUDE_SETPOINT, TRACKING and
/// HOME out; every POSE triggers. Ticks only notice that there are none.
class ControlNode : public bus::Node {
 public:
  ControlNode(bus::Bus& bus, const ControlConfig& config);
  int64_t TickPeriod() const override { return kTick; }
  void Tick(int64_t utime) override;
  bus::NodeReport Report() const override;

 private:
  static constexpr int64_t kTick = 50'000;  // us
  struct List {
    int32_t seq;
    int64_t utime;  // of its sweep
    std::vector<world::Obstacle> obstacles;
  };
  void OnPlan(const plan_t& message);
  void OnObstacles(const obstacles_t& message);
  void OnPose(const pose_t& message);
  void UpdateLate(const pose_t& message);
  void OnState(const flight_state_t& message);
  Eigen::Vector3d Home() const;
  void TellHome();
  void OnGeofence(const geofence_t& message);
  std::string Refusal(const plan_t& message);
  std::string Breach(const world::Claim& claim, bool to_land) const;
  const List* ListOf(const plan_t& message) const;
  void Send(int64_t utime, const Setpoint& setpoint);
  void SendTracking(int64_t utime);
  std::string Reason() const;
  double Silence() const { return 1e-6 * static_cast<double>(ticks_without_pose_ * kTick); }
  int64_t Origin(int64_t utime);

  bus::Bus& bus_;
  ControlConfig config_;
  Controller controller_;
  bus::Epoch epoch_;
  bus::Epoch flown_;  // of the last pose that was aligned: the attitude loop goes by it
  Eigen::Vector3d p_WB_ = Eigen::Vector3d::Zero();  // of the last pose, m
  std::deque<List> lists_;                          // newest last
  /// The last FLIGHT_STATE that knew where it took off: the geofence counts from there.
  std::optional<flight_state_t> led_;
  world::Geofence fence_;  // its own, else what mission told last
  /// The first FLIGHT_STATE of a mission process that asks for the landing: its `seq`, and when
  /// that process started.
  std::optional<std::pair<int64_t, int32_t>> landing_;
  bus::AutopilotState autopilot_;
  bus::StampOrder state_order_;
  bool hears_mission_ = false;
  int64_t asked_to_fly_ = 0;       // utime of the last FLIGHT_STATE that asks for a flight
  std::optional<int64_t> origin_;  // utime that the core's seconds count from
  int64_t last_tracking_ = 0;
  int ticks_without_pose_ = 0;
  PoseAge pose_age_;
  std::string pose_reason_;  // why the pose is not usable
  int64_t n_plans_ = 0, n_refused_ = 0;
};

}  // namespace chase::control
