#pragma once

#include <string>
#include <vector>

#include "test/baselines/pieces.h"
#include "test/compare/mission.h"

namespace chase::compare {

/// One answer of the planner.
struct Replan {
  double t = 0.0;                      ///< s
  double wall_ms = 0.0, cpu_ms = 0.0;  ///< round the call: steady clock, thread's processor time
  planning::Verdict verdict = planning::Verdict::kBrake;
  std::string reason;
  baselines::Pieces flown;  ///< what was flown until the next one
};

struct Sample {
  double t = 0.0;          ///< s
  world::State chaser;     ///< p_WB and derivatives
  Eigen::Vector3d target;  ///< true p_WT, m
  Eigen::Vector3d target_velocity;
};

struct Rollout {
  std::vector<Replan> replans;
  std::vector<Sample> samples;  ///< 100 Hz, t = 0.01 i, i = 1..n
};

/// Flies the mission with ideal tracking: every replan_period the planner is asked from the state
/// that the running plan has, and its answer is flown until the next. No latency; touching an
/// obstacle does not end the flight. A plan that is over leaves the drone at rest where it ended.
Rollout Fly(const Mission& mission, planning::Planner* planner);

}  // namespace chase::compare
