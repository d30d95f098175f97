#include "services/planning/planner_config.h"

#include <cmath>
#include <cstdio>
#include <utility>

namespace chase::planning {

static_assert(PlannerConfig{}.z_max + PlannerConfig{}.drone_radius +
                  PlannerConfig{}.tracking_tube <=
              world::kFlightVolume.listed);
namespace {

std::string Say(const char* field, double value, const char* limit) {
  char text[160];
  std::snprintf(text, sizeof text, "%s is %g, must be %s", field, value, limit);
  return text;
}

}  // namespace

std::string PlannerConfig::Problem() const {
  if (degree < 5 || degree > 6) return Say("degree", degree, "5 or 6");
  if (steps < 2 || steps > 6) return Say("steps", steps, "2 to 6");
  if (skeletons < 1 || skeletons > 24) return Say("skeletons", skeletons, "1 to 24");
  if (!(std::pow(skeletons, steps) <= 200000.0))
    return Say("skeletons ^ steps", std::pow(skeletons, steps), "at most 200000");
  if (!(desired_distance > 0.1)) return Say("desired_distance", desired_distance, "above 0.1 m");
  if (!(radius_spread >= 0.0 && radius_spread < 0.9))
    return Say("radius_spread", radius_spread, "in [0, 0.9)");
  if (!(waypoint_weight > 0.0)) return Say("waypoint_weight", waypoint_weight, "above 0");
  const std::pair<const char*, double> not_negative[] = {{"weight_smooth", weight_smooth},
                                                         {"weight_obstacle", weight_obstacle},
                                                         {"weight_distance", weight_distance},
                                                         {"weight_yaw", weight_yaw},
                                                         {"rho_acceleration", rho_acceleration},
                                                         {"rho_jerk", rho_jerk},
                                                         {"rho_height", rho_height},
                                                         {"cost_min", cost_min},
                                                         {"cost_max", cost_max},
                                                         {"drone_radius", drone_radius},
                                                         {"tracking_tube", tracking_tube},
                                                         {"safety_margin", safety_margin},
                                                         {"sight_margin", sight_margin},
                                                         {"refine_room", refine_room},
                                                         {"sigmas", sigmas},
                                                         {"drag", drag},
                                                         {"max_speed", max_speed},
                                                         {"max_acceleration", max_acceleration},
                                                         {"min_distance", min_distance}};
  for (const auto& [field, value] : not_negative)
    if (!(value >= 0.0)) return Say(field, value, "at least 0");
  if (!(cost_max >= cost_min)) return Say("cost_max", cost_max, "at least cost_min");
  if (!(cost_range > 0.0)) return Say("cost_range", cost_range, "above 0");
  if (!(z_max >= z_min)) return Say("z_max", z_max, "at least z_min");
  if (!(max_elevation_deg >= 0.0 && max_elevation_deg < 90.0))
    return Say("max_elevation_deg", max_elevation_deg, "in [0, 90)");
  if (!(max_bearing_deg >= 0.0 && max_bearing_deg < 90.0))
    return Say("max_bearing_deg", max_bearing_deg, "in [0, 90)");
  if (!(view_down_deg >= 0.0 && view_down_deg < 90.0))
    return Say("view_down_deg", view_down_deg, "in [0, 90)");
  if (!(view_up_deg > -view_down_deg && view_up_deg < 90.0) && view_down_deg > 0.0)
    return Say("view_up_deg", view_up_deg, "above -view_down_deg, below 90");
  if (!(max_yaw_rate > 0.0)) return Say("max_yaw_rate", max_yaw_rate, "above 0");
  return "";
}

double PlannerConfig::desired_height() const {
  const double mean = 0.5 * (elevation_low_deg + elevation_high_deg);
  return desired_distance * std::sin(mean * M_PI / 180.0);
}

std::optional<View> PlannerConfig::view() const {
  if (view_down_deg <= 0.0) return std::nullopt;
  constexpr double deg = M_PI / 180.0;
  return View{std::tan(view_down_deg * deg), std::tan(view_up_deg * deg),
              std::tan(max_bearing_deg * deg), drag};
}

PlannerConfig PlannerConfig::Literal() {
  PlannerConfig c;
  c.degree = 5;
  c.adaptive = c.refine = c.minkowski_sums = false;
  c.drone_radius = c.tracking_tube = c.safety_margin = c.sight_margin = c.sigmas = 0.0;
  c.max_speed = c.max_acceleration = c.max_elevation_deg = c.view_down_deg = 0.0;
  c.min_distance = c.rho_height = 0.0;
  c.z_min = c.z_max = 0.0;
  return c;
}

}  // namespace chase::planning
