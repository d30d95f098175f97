#pragma once

#include <optional>
#include <string>

#include "common/world/flight_volume.h"

namespace chase::planning {

/// Edges of the image as tangents in the body's frame: below and above its level, and to either
/// side of the optical axis; and the drag [1/s] that the body leans against as it flies.
struct View {
  double down = 0.0, up = 0.0, side = 0.0, drag = 0.0;
};

/// Parameters of the planner. Symbols of Jeon 2021 in brackets.
struct PlannerConfig {
  int degree = 6;
  int steps = 4;
  int skeletons = 6;
  double desired_distance = 2.5;
  double radius_spread = 0.15;
  double elevation_low_deg = 6.0;
  double elevation_high_deg = 14.0;
  double waypoint_weight = 10.0;
  bool adaptive = true;
  bool refine = true;
  double refine_room = 0.05;
  bool exact_visibility = true;
  bool minkowski_sums = true;

  double weight_smooth = 0.05, weight_obstacle = 1.0, weight_distance = 1.0, weight_yaw = 1.0;
  double rho_acceleration = 1.0, rho_jerk = 0.1, rho_height = 1.0;
  double cost_min = 0.01, cost_max = 1.0, cost_range = 2.0;

  double drone_radius = 0.25;
  double tracking_tube = 0.12;
  double safety_margin = 0.03;
  double sight_margin = 0.1;
  double sigmas = 2.0;

  double max_speed = 4.0;
  double max_acceleration = 6.0;
  double z_min = world::kFlightVolume.low;
  double z_max = world::kFlightVolume.high;
  double max_elevation_deg = 28.0;
  double view_down_deg = 37.5;
  double view_up_deg = 13.5;
  double max_bearing_deg = 37.4;
  double drag = 0.25;
  double min_distance = 0.8;
  double max_yaw_rate = 2.5;

  template <class V>
  void Visit(V& v) {
    v("degree", degree, "of the plan's polynomials [m_p], 5 or 6");
    v("steps", steps, "view skeletons are placed at this many times [N]");
    v("skeletons", skeletons, "points around the target at each of them [N_s]");
    v("desired_distance", desired_distance, "to the target [l_des], m");
    v("radius_spread", radius_spread, "skeleton radii are (1 -+ this) l_des");
    v("elevation_low_deg", elevation_low_deg, "of the lower skeletons above the target");
    v("elevation_high_deg", elevation_high_deg, "of the upper skeletons above the target");
    v("waypoint_weight", waypoint_weight, "pull of the skeletons on a candidate [w_p], 1/s^3");
    v("adaptive", adaptive, "skeleton layout follows clutter and the target's motion");
    v("refine", refine, "move the winner, and the running plan, downhill while certified");
    v("refine_room", refine_room, "more margin that moved plans keep where there is room, m");
    v("exact_visibility", exact_visibility, "exact sight condition; false: the paper's bound");
    v("minkowski_sums", minkowski_sums,
      "proofs are about solids; false: about ellipsoids grown along their axes, to compare");
    v("weight_smooth", weight_smooth, "[w_1]");
    v("weight_obstacle", weight_obstacle, "[w_2]");
    v("weight_distance", weight_distance, "[w_3]");
    v("weight_yaw", weight_yaw, "[w_4]");
    v("rho_acceleration", rho_acceleration, "of squared acceleration in J1 [rho_2]");
    v("rho_jerk", rho_jerk, "of squared jerk in J1 [rho_3]");
    v("rho_height", rho_height,
      "of the squared departure in J3 from the skeletons' mean height above the target; "
      "0: the paper's");
    v("cost_min", cost_min, "obstacle cost far away [c_min]");
    v("cost_max", cost_max, "obstacle cost at its centre [c_max]");
    v("cost_range", cost_range, "where it ends, in obstacle radii [l_s]");
    v("drone_radius", drone_radius, "of the drone's sphere, m");
    v("tracking_tube", tracking_tube, "the body stays this near to the plan, m");
    v("safety_margin", safety_margin, "kept beyond sphere and tube where the start allows it, m");
    v("sight_margin", sight_margin, "kept between the line of sight and obstacles, m");
    v("sigmas", sigmas, "uncertain obstacles and targets are widened by this many deviations");
    v("max_speed", max_speed, "m/s; 0: no limit");
    v("max_acceleration", max_acceleration, "m/s^2; 0: no limit");
    v("z_min", z_min, "lowest height of a plan above the ground, m; z_min = z_max: no limits");
    v("z_max", z_max,
      "greatest height of a plan above the ground, m; mapping lists up to statics.band_high");
    v("max_elevation_deg", max_elevation_deg, "of the target out of the level; 0: no limit");
    v("view_down_deg", view_down_deg,
      "the image's lower edge below the body's level, less what tilt and calibration may be off; "
      "0: the image is not asked about");
    v("view_up_deg", view_up_deg, "its upper edge above the body's level, the same way");
    v("max_bearing_deg", max_bearing_deg, "its sides off the optical axis, the same way");
    v("drag", drag, "linear drag over mass along the ground, as control's: it tilts the body, 1/s");
    v("min_distance", min_distance, "from the drone to the target's centre, m; 0: no limit");
    v("max_yaw_rate", max_yaw_rate, "of the plan's yaw, rad/s");
  }
  /// Of what has to stay clear in any case: sphere and tube, m.
  double hard_radius() const { return drone_radius + tracking_tube; }
  /// Above the target, m: at the skeletons' mean elevation.
  double desired_height() const;
  /// The image's edges; none where it is not asked about.
  std::optional<View> view() const;
  std::string Problem() const;

  /// Problem 2 as the paper states it: no inflation, no limits, fixed layout, no refinement.
  static PlannerConfig Literal();
};

}  // namespace chase::planning
