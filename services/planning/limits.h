#pragma once

#include "services/planning/problem.h"

namespace chase::planning {

/// Speed, acceleration, height, distance and elevation of the target, each certified on [0,1]: by
/// the control points where those tell, else as the sign of a polynomial. What rounding leaves open
/// counts as broken.
bool KeepsLimits(const Curve& plan, const Problem& problem);

}  // namespace chase::planning
