#pragma once

#include <vector>

#include "services/planning/problem.h"

namespace chase::planning {

/// Does the bearing of the target from the plan stay within `half_angle` (rad, below pi/2) of the
/// yaw over all of [0,1]? Certified by subdivision: on a piece where the yaw lies in [a, b], the
/// control points of target - plan must lie between the directions b - half_angle and
/// a + half_angle; rounding is covered by a margin, and what stays open counts as no. `yaw`: power
/// basis in tau, rad.
bool KeepsBearing(const Curve& plan, const Curve& target, const std::vector<double>& yaw,
                  double half_angle);

}  // namespace chase::planning
