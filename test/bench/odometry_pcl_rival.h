#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace chase::odometry::rival {

/// Pose of `source` in `target` by PCL's generalised ICP after a voxel filter of edge `voxel` m,
/// its search trees being PCL's.
Eigen::Isometry3d MatchWithGicp(const std::vector<Eigen::Vector3f>& source,
                                const std::vector<Eigen::Vector3f>& target, double voxel,
                                const Eigen::Isometry3d& guess);

}  // namespace chase::odometry::rival
