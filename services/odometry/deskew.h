#pragma once

#include <vector>

#include "services/odometry/sweep.h"

namespace chase::odometry {

/// A pose in single precision for many points.
class FloatPose {
 public:
  explicit FloatPose(const Pose& X) {
    columns_.setZero();
    columns_.topLeftCorner<3, 3>() = X.R.toRotationMatrix().cast<float>();
    columns_.topRightCorner<3, 1>() = X.p.cast<float>();
  }

  /// A column is one vector of the processor.
  Eigen::Vector3f operator*(const Eigen::Vector3f& p) const {
    const Eigen::Vector4f moved = columns_.col(0) * p.x() +
                                  (columns_.col(1) * p.y() + columns_.col(2) * p.z()) +
                                  columns_.col(3);
    return moved.head<3>();
  }

 private:
  Eigen::Matrix4f columns_;
};

/// The body's motion over a sweep, seen from the body at the sweep's end: poses X_EB(t) at evenly
/// spaced times, E being the body frame at the end.
class SweepMotion {
 public:
  /// `poses_WB` at start, start + step, ...; the last one belongs to the sweep's end.
  SweepMotion(const std::vector<Pose>& poses_WB, double step);

  /// A body at rest in E.
  static SweepMotion Still();

  /// A point measured in the body frame at time t [s after the sweep's start], seen from E. Between
  /// two poses the point moves on the chord.
  Eigen::Vector3f ToEnd(const Eigen::Vector3f& p_B, float t) const;

 private:
  std::vector<FloatPose> knots_;
  float inverse_step_ = 1.0f;
};

/// The points of a sweep in the body frame at its end.
std::vector<Eigen::Vector3f> Deskewed(const std::vector<SweepPoint>& points, const Pose& X_BL,
                                      const SweepMotion& motion);

}  // namespace chase::odometry
