#pragma once

#include <vector>

#include "services/odometry/sweep.h"

namespace chase::odometry {

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
  struct Knot {
    Eigen::Matrix3f R;
    Eigen::Vector3f p;
  };
  std::vector<Knot> knots_;
  float inverse_step_ = 1.0f;
};

/// The points at `indices` in the body frame at the sweep's end.
std::vector<FeaturePoint> Deskewed(const std::vector<SweepPoint>& points,
                                   const std::vector<int>& indices, const Pose& X_BL,
                                   const SweepMotion& motion);

}  // namespace chase::odometry
