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

/// The rig with the camera turned to R_BC where it is; the LiDAR moves with it, since its pose is
/// known to the camera.
world::Rig WithCamera(const world::Rig& rig, const Eigen::Matrix3d& R_BC);

}  // namespace chase::calibrate
