#pragma once

#include <memory>

#include "services/planning/planner.h"
#include "services/planning/search.h"

namespace chase::planning {

/// The ladder of rungs around a search: chase, wider skeletons, keep the running plan, safe without
/// (all of the) sight, brake to hover.
std::unique_ptr<Planner> MakeLadder(const PlannerConfig& config, std::unique_ptr<Search> search);

/// Comes to rest: b3 = b4 = b5 in Bernstein form, which continues position, velocity, acceleration
/// and jerk and ends with none. Of several durations the shortest that is safe and within the
/// limits; else the one that stays farthest from obstacles. `safe` tells which.
world::Trajectory BrakePlan(const PlannerConfig& config, const PlanRequest& request, bool* safe);

}  // namespace chase::planning
