#include "deploy/calibrate/rig_file.h"

#include <cmath>

namespace chase::calibrate {
namespace {

Eigen::Isometry3d Pose(const Eigen::Matrix3d& R, const Eigen::Vector3d& p) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = R;
  X.translation() = p;
  return X;
}

}  // namespace

Eigen::Isometry3d LidarInCamera(const world::Rig& rig) {
  return Pose(rig.R_BC(), rig.camera_position).inverse() * Pose(rig.R_BL(), rig.lidar_position);
}

world::Rig WithLidar(world::Rig rig, const Eigen::Isometry3d& X_CL) {
  const Eigen::Isometry3d X_BL = Pose(rig.R_BC(), rig.camera_position) * X_CL;
  const Eigen::Matrix3d R = X_BL.linear();
  rig.lidar_position = X_BL.translation();
  rig.lidar_rpy_deg = Eigen::Vector3d(std::atan2(R(2, 1), R(2, 2)),
                                      std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2))),
                                      std::atan2(R(1, 0), R(0, 0))) *
                      180.0 / M_PI;
  return rig;
}

}  // namespace chase::calibrate
