#pragma once

#include <algorithm>
#include <vector>

#include "services/odometry/sweep.h"

namespace chase::odometry {

/// A pose in single precision for many points. A fourth number, always 0, fills the processor's
/// vectors.
class FloatPose {
 public:
  explicit FloatPose(const Pose& X) {
    columns_.setZero();
    columns_.topLeftCorner<3, 3>() = X.R.toRotationMatrix().cast<float>();
    columns_.topRightCorner<3, 1>() = X.p.cast<float>();
  }

  Eigen::Vector4f operator*(const Eigen::Vector4f& p) const {
    return columns_.col(0) * p.x() + (columns_.col(1) * p.y() + columns_.col(2) * p.z()) +
           columns_.col(3);
  }
  Eigen::Vector3f operator*(const Eigen::Vector3f& p) const {
    return (*this * Eigen::Vector4f(p.x(), p.y(), p.z(), 0.0f)).head<3>();
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

  /// A point measured in the body frame at time t [s after the sweep's start], seen from E; its
  /// fourth number is 0. Between two poses the point moves on the chord.
  Eigen::Vector4f ToEnd(const Eigen::Vector4f& p_B, float t) const {
    const float s = std::max(0.0f, t * inverse_step_);
    const int i = std::min(static_cast<int>(s), last_);
    const Eigen::Vector4f from = knots_[static_cast<size_t>(i)] * p_B;
    if (i == last_) return from;
    const Eigen::Vector4f to = knots_[static_cast<size_t>(i) + 1] * p_B;
    return from + (s - static_cast<float>(i)) * (to - from);
  }

 private:
  std::vector<FloatPose> knots_;
  int last_;  // knot
  float inverse_step_;
};

/// The points of a sweep in the body frame at its end.
std::vector<Eigen::Vector3f> Deskewed(const std::vector<SweepPoint>& points, const Pose& X_BL,
                                      const SweepMotion& motion);

}  // namespace chase::odometry
