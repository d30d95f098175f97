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

/// Roll, pitch and yaw of R = Rz(yaw) Ry(pitch) Rx(roll), degrees.
Eigen::Vector3d RollPitchYaw(const Eigen::Matrix3d& R) {
  return Eigen::Vector3d(std::atan2(R(2, 1), R(2, 2)),
                         std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2))),
                         std::atan2(R(1, 0), R(0, 0))) *
         180.0 / M_PI;
}

}  // namespace

Eigen::Isometry3d LidarInCamera(const world::Rig& rig) {
  return Pose(rig.R_BC(), rig.camera_position).inverse() * Pose(rig.R_BL(), rig.lidar_position);
}

world::Rig WithLidar(world::Rig rig, const Eigen::Isometry3d& X_CL) {
  const Eigen::Isometry3d X_BL = Pose(rig.R_BC(), rig.camera_position) * X_CL;
  rig.lidar_position = X_BL.translation();
  rig.lidar_rpy_deg = RollPitchYaw(X_BL.linear());
  return rig;
}

world::Rig WithCamera(const world::Rig& rig, const Eigen::Matrix3d& R_BC) {
  world::Rig turned = rig, level = rig;
  level.camera_roll_deg = level.camera_pitch_deg = level.camera_yaw_deg = 0.0;
  const Eigen::Vector3d rpy = RollPitchYaw(R_BC * level.R_BC().transpose());
  turned.camera_roll_deg = rpy.x();
  turned.camera_pitch_deg = rpy.y();
  turned.camera_yaw_deg = rpy.z();
  return WithLidar(turned, LidarInCamera(rig));
}

}  // namespace chase::calibrate
