#pragma once

#include <optional>

#include "common/world/scenario.h"
#include "deploy/worlds/layout.h"

namespace chase::worlds {

inline constexpr double kWalkerToTarget = 0.6;  // m of free way between a walker and the target

/// Somebody who walks about the area, stops and turns back, whatever the drone does: an upright
/// cylinder that keeps clear of what stands, of the other movers, of the target by kWalkerToTarget,
/// and of the hovering drone before the chase begins. Nothing when no such walk was found.
std::optional<world::MoverSpec> DrawWalker(const world::Scenario& scenario, const Area& area,
                                           Random* random);

/// Adds up to `count` walkers; false when fewer found room.
bool AddWalkers(int count, const Area& area, Random* random, world::Scenario* scenario);

}  // namespace chase::worlds
