#include "services/planning/planning_config.h"

#include <algorithm>
#include <cstdio>

#include "services/planning/planner.h"

namespace chase::planning {

std::string PlanningConfig::Problem() const {
  char text[160] = "";
  const auto below = [&text](const char* field, double value, const char* limit) {
    std::snprintf(text, sizeof text, "%s is %g, must be %s", field, value, limit);
  };
  const auto names = PlannerNames();
  if (std::find(names.begin(), names.end(), planner_name) == names.end())
    return "planner_name is '" + planner_name + "', must be chase, reference or reference-double";
  if (!(horizon >= 0.5 && horizon <= 20.0)) below("horizon", horizon, "0.5 to 20 s");
  if (!(min_period > 0.0)) below("min_period", min_period, "above 0 s");
  if (!(replan_period >= min_period)) below("replan_period", replan_period, "at least min_period");
  if (!(latency >= 0.0 && latency <= 0.5)) below("latency", latency, "0 to 0.5 s");
  if (!(target_acceleration >= 0.0 && target_acceleration <= 20.0))
    below("target_acceleration", target_acceleration, "0 to 20 m/s^2");
  if (!(target_memory >= 0.05 && target_memory <= 60.0))
    below("target_memory", target_memory, "0.05 to 60 s");
  if (!(takeoff_height >= 0.0)) below("takeoff_height", takeoff_height, "at least 0 m");
  if (!(takeoff_time > 0.5)) below("takeoff_time", takeoff_time, "above 0.5 s");
  if (!(listed_within >= 3.0))
    below("listed_within", listed_within, "at least 3 m, in which it comes to rest");
  if (!(landing_room >= 0.0 && landing_room <= 5.0))
    below("landing_room", landing_room, "0 to 5 m");
  if (!(landing_slope_deg > 0.0 && landing_slope_deg <= 45.0))
    below("landing_slope_deg", landing_slope_deg, "above 0 and at most 45 degrees");
  if (!(landing_reach >= 0.0 && landing_reach <= 8.0))
    below("landing_reach", landing_reach, "0 to 8 m, as far as the map is surely known");
  return text;
}

}  // namespace chase::planning
