#pragma once

#include <cstdint>
#include <optional>

#include "chase/flight_state_t.hpp"
#include "chase/geofence_t.hpp"
#include "chase/obstacles_t.hpp"
#include "chase/plan_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/prediction_t.hpp"
#include "chase/tracking_t.hpp"
#include "common/bus/autopilot_state.h"
#include "common/bus/bus.h"
#include "common/bus/epoch.h"
#include "common/bus/node.h"
#include "common/bus/stamp_order.h"
#include "common/world/sweep_run.h"
#include "services/planning/pilot.h"

namespace chase::planning {

/// PREDICTION, OBSTACLES, FLIGHT_STATE, GEOFENCE, FCU_STATUS and POSE in, PLAN out; POSE is the
/// clock.
class PlanningNode : public bus::Node {
 public:
  PlanningNode(bus::Bus& bus, const PlanningConfig& config);
  bus::NodeReport Report() const override;

 private:
  void OnPrediction(const prediction_t& message);
  void OnObstacles(const obstacles_t& message);
  std::optional<std::vector<world::Obstacle>> Listed(const obstacles_t& message);
  void OnState(const flight_state_t& message);
  void OnPose(const pose_t& message);
  void CheckMission(int64_t utime);
  void Send(const PlanResult& plan);
  const char* WaitsFor() const;  ///< before the first plan
  int64_t Origin(int64_t utime);

  bus::Bus& bus_;
  PlanningConfig config_;
  Pilot pilot_;
  bus::Epoch epoch_;
  bus::AutopilotState autopilot_;
  world::SweepRun sweeps_;
  bool is_usable_ = false;  ///< the newest POSE
  bool waits_for_autopilot_ = false;
  std::optional<int64_t> origin_;  // utime that the core's seconds count from
  bus::StampOrder state_order_;
  int64_t state_utime_ = 0;              // of the newest FLIGHT_STATE; 0: none
  Task task_ = Task::kGround;            // that it asked for
  std::optional<Eigen::Vector3d> home_;  // that it tells: GEOFENCE counts from there, m
  polynomial_t target_{};                // as predicted; no coefficients: none yet
  int64_t n_plans_ = 0;
  int64_t n_verdicts_[plan_t::MITIGATE + 1] = {};
};

}  // namespace chase::planning
