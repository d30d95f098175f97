#pragma once

#include "services/planning/problem.h"

namespace chase::planning {

/// Moves the free control points of a feasible plan downhill in cost; every accepted step is
/// certified anew. True when the plan changed; it is never worse than before.
bool Refine(const PlannerConfig& config, const Problem& problem, double sight_from, Curve* plan,
            Cost* cost);

}  // namespace chase::planning
