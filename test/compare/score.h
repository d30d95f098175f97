#pragma once

#include <map>
#include <string>
#include <vector>

#include "test/compare/rollout.h"

namespace chase::compare {

/// A stretch in which the drone touches an obstacle or the target is hidden.
struct Lapse {
  std::string what;  ///< "touches" or "hidden"
  double from = 0.0, to = 0.0;
  int obstacle = -1;  ///< the first one that does it
  std::string plan;   ///< verdict and reason of the plan flown when it began
};

struct Times {
  double mean = 0.0, p50 = 0.0, p95 = 0.0, p99 = 0.0, max = 0.0;  ///< ms
};

/// Figures of one flight. Definitions: test/compare/README.md.
struct Score {
  double safe_ratio = 0, visible_ratio = 0, visible_ratio_physical = 0;
  double min_clearance_m = 0, min_sight_clearance_m = 0;
  double distance_ratio = 0, distance_error = 0, travel_ratio = 0;
  double acceleration_cost = 0, jerk_cost = 0, yaw_rate_rms = 0;
  double peak_speed = 0, peak_acceleration = 0, min_height = 0, max_height = 0;
  bool proved_safe = false;  ///< every flown piece is proved clear, not only at the samples
  Times plan_ms, plan_cpu_ms;
  long replans = 0, fallbacks = 0;
  std::map<std::string, int> verdicts;
  std::vector<Lapse> lapses;
};

Score Judge(const Mission& mission, const Rollout& rollout);

}  // namespace chase::compare
