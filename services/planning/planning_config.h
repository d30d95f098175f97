#pragma once

#include <string>

#include "common/world/forecast.h"
#include "services/planning/planner_config.h"

namespace chase::planning {

/// Parameters of the planning process.
struct PlanningConfig {
  std::string planner_name = "chase";
  double horizon = 2.5;
  double replan_period = 0.2;
  double min_period = 0.04;
  double latency = 0.04;
  double target_acceleration = world::kTargetManoeuvre.acceleration;
  double target_memory = world::kTargetManoeuvre.memory;
  double takeoff_height = 1.2;
  double takeoff_time = 3.0;
  double search_yaw_rate = 1.0;
  double listed_within = world::kFlightVolume.around;
  double landing_room = 0.3;
  double landing_slope_deg = 10.0;
  double landing_reach = 6.0;
  PlannerConfig planner;

  template <class V>
  void Visit(V& v) {
    v("planner_name", planner_name, "chase, reference or reference-double");
    v("horizon", horizon, "length of a plan [T], s");
    v("replan_period", replan_period, "age at which a plan is renewed without other cause, s");
    v("min_period", min_period, "least time between plans, s");
    v("latency", latency, "a plan starts this long after the pose that triggered it, s");
    v("target_acceleration", target_acceleration,
      "standard deviation of what the forecast of the target does not foresee, per axis, m/s^2");
    v("target_memory", target_memory, "time constant of that acceleration, s");
    v("takeoff_height", takeoff_height, "climb before the chase, above the start, m");
    v("takeoff_time", takeoff_time, "duration of that climb, s");
    v("search_yaw_rate", search_yaw_rate, "turning while the target is lost, rad/s");
    v("listed_within", listed_within,
      "of the drone, plan view: obstacles that are farther are in no list (mapping's "
      "statics.radius), m; no plan leads there");
    v("landing_room", landing_room,
      "that has to be level and free around the body's sphere where it comes down, m");
    v("landing_slope_deg", landing_slope_deg, "of the ground that counts as level, at most");
    v("landing_reach", landing_reach, "level ground is looked for so far away, m; 0: only below");
    v("planner", planner, "of Problem 2");
  }
  std::string Problem() const;
};

}  // namespace chase::planning
