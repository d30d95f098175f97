#pragma once

#include <vector>

#include "common/world/obstacle.h"
#include "services/mapping/ground.h"

namespace chase::mapping {

/// The ground within `radius` m (plan view) of `origin` as boxes about planes through its tiles, as
/// few as lie within half of `height` of all of them. They reach `height` m above the ground, as
/// high as what mapping lists as no obstacle. Frame W, for time t, s; ids are those of the places.
std::vector<world::Obstacle> GroundSlabs(const GroundModel& ground, const Eigen::Vector3d& origin,
                                         double radius, double height, double t, double duration);

}  // namespace chase::mapping
