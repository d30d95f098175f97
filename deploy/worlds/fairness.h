#pragma once

#include <string>

#include "common/world/rig.h"
#include "common/world/scenario.h"
#include "deploy/worlds/kinds.h"

namespace chase::worlds {

/// Why nobody could fly this world: the target touches something, there is no room for the drone
/// along its way, at the start or in the climb, it is not in view at the start, somebody walks
/// through a wall or into the target. Empty when the world is fair.
std::string Unfairness(const world::Scenario& scenario, const world::Rig& rig,
                       const Options& options);

}  // namespace chase::worlds
