#pragma once

#include <memory>

#include "services/planning/planner.h"
#include "services/planning/search.h"

namespace chase::planning {

/// The ladder of rungs around a search: chase, wider skeletons, keep the running plan, safe without
/// (all of the) sight, brake to hover.
std::unique_ptr<Planner> MakeLadder(const PlannerConfig& config, std::unique_ptr<Search> search);

}  // namespace chase::planning
