#pragma once

#include <Eigen/Geometry>
#include <string>

#include "common/config/config.h"
#include "common/world/rig_file.h"

namespace chase::calibrate {

using world::RigFile;

/// Pose of the LiDAR in the camera by a rig, and the rig with another one. The camera's own place
/// on the body stays: a ruler gives it.
Eigen::Isometry3d LidarInCamera(const world::Rig& rig);
world::Rig WithLidar(world::Rig rig, const Eigen::Isometry3d& X_CL);

}  // namespace chase::calibrate
