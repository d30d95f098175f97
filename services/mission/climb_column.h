#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/world/obstacle.h"

namespace chase::mission {

/// Does an obstacle other than the ground reach into the upright column that a body of `radius`
/// sweeps when it climbs by `height` from p_WB `p`? All in m, frame W, obstacles where they were
/// measured. The LiDAR looks no higher than 15 degrees: of what hangs steeply above only that is
/// known which was seen from elsewhere.
bool IsBlocked(const std::vector<world::Obstacle>& obstacles, const Eigen::Vector3d& p,
               double radius, double height);

}  // namespace chase::mission
