#include "common/world/rig.h"

#include <Eigen/Geometry>
#include <cmath>

namespace chase::world {

Eigen::Matrix3d Rig::R_BL() const {
  const Eigen::Vector3d rpy = lidar_rpy_deg * M_PI / 180.0;
  return (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Matrix3d Rig::R_BC() const {
  const double a = camera_pitch_deg * M_PI / 180.0;
  Eigen::Matrix3d R;
  R.col(0) = Eigen::Vector3d(0.0, -1.0, 0.0);
  R.col(2) = Eigen::Vector3d(std::cos(a), 0.0, -std::sin(a));
  R.col(1) = R.col(2).cross(R.col(0));
  return R;
}

}  // namespace chase::world
