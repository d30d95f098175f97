#pragma once

#include <Eigen/Geometry>
#include <string>

#include "common/config/config.h"
#include "common/world/rig.h"

namespace chase::calibrate {

/// The file that every service's --config loads: key `rig`.
struct RigFile {
  world::Rig rig;
  template <class V>
  void Visit(V& v) {
    v("rig", rig, "where the sensors sit, and the camera");
  }
};

/// Pose of the LiDAR in the camera by a rig, and the rig with another one. The camera's own place
/// on the body stays: a ruler gives it.
Eigen::Isometry3d LidarInCamera(const world::Rig& rig);
world::Rig WithLidar(world::Rig rig, const Eigen::Isometry3d& X_CL);

}  // namespace chase::calibrate
