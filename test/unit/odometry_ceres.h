#pragma once

#include "services/odometry/scan_matcher.h"

namespace chase::odometry::test {

/// The matching problem at fixed correspondences (those at `start`) solved by Ceres with automatic
/// derivatives: the reference for the hand-made Gauss-Newton. `kernel` as in MatchConfig, m.
Pose MatchWithCeres(const std::vector<Eigen::Vector3f>& planes, const SurfaceMap& map,
                    const Pose& start, double kernel);

}  // namespace chase::odometry::test
