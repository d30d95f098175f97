#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

namespace chase::odometry {

/// One return of the LiDAR.
struct SweepPoint {
  Eigen::Vector3f p = Eigen::Vector3f::Zero();  ///< frame L at the point's own time, m
  float t = 0.0f;                               ///< after the sweep's start, s
  uint8_t intensity = 0;                        ///< reflectivity
  uint8_t ring = 0;                             ///< laser
};

/// One revolution as measured: not deskewed.
struct Sweep {
  double start = 0.0;  ///< s
  std::vector<SweepPoint> points;
};

/// One sample of the inertial unit.
struct ImuSample {
  double t = 0.0;                                   ///< s
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< specific force, frame B, m/s^2
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< w_WB_B, frame B, rad/s
};

/// Pose X_AB: x_A = R_AB x_B + p_AB.
struct Pose {
  Eigen::Quaterniond R = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  ///< m

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return R * x + p; }
  Pose operator*(const Pose& other) const { return {(R * other.R).normalized(), R * other.p + p}; }
  Pose Inverse() const { return {R.conjugate(), -(R.conjugate() * p)}; }
};

}  // namespace chase::odometry
