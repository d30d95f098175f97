#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/world/obstacle.h"

namespace chase::world {

/// Does an obstacle other than the ground reach into the upright column that a body of `radius`
/// sweeps when it climbs by `height` from p_WB `p`, or comes down by it to there? All in m, frame
/// W, obstacles where they were measured. Only what is listed is known: a LiDAR that looks no
/// higher than 15 degrees lists of what hangs steeply above what it saw from elsewhere.
bool IsColumnBlocked(const std::vector<Obstacle>& obstacles, const Eigen::Vector3d& p,
                     double radius, double height);

}  // namespace chase::world
