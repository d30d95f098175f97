#pragma once

#include "common/math/rotation.h"
#include "services/odometry/error_state_filter.h"

namespace chase::odometry {

/// W seen from the frame M in which filter and map live. M is upright only as far as the
/// accelerometer could tell at the start, its bias included: 0.05 m/s^2 are 5 mrad, or half a metre
/// at a distance of 100 m. The filter learns gravity in M, and W is M turned upright about the
/// start by the smallest turn. M's heading is that of the body at the start as the LiDAR's
/// calibrated attitude tells it: what the filter learns of that turns W about its vertical.
class LevelFrame {
 public:
  /// M and W share the point `start` and agree on it.
  explicit LevelFrame(const Eigen::Vector3d& start) : start_(start) {}

  /// The body's attitude in M at the start.
  void BeginAt(const Eigen::Quaterniond& R_MB) { up_B_ = R_MB.conjugate() * up_B_.UnitZ(); }

  /// By gravity, which must not vanish, and the mounting as they are known in `state`.
  void Turn(const NavState& state);

  const Eigen::Quaterniond& R_WM() const { return R_WM_; }
  /// The body's pose: R_WI.
  Pose ToWorld(const NavState& state) const {
    const Pose X_WB = ToWorld(state.pose());
    return {X_WB.R * math::ExpSO3(state.mount), X_WB.p};
  }
  Pose ToWorld(const Pose& X_MB) const { return {R_WM_ * X_MB.R, ToWorld(X_MB.p)}; }
  Eigen::Vector3d ToWorld(const Eigen::Vector3d& p_M) const {
    return start_ + R_WM_ * (p_M - start_);
  }

  /// Covariance of (p, v, rotation error) in W: that in M, and what is not known of gravity times
  /// the distance from the start.
  Eigen::Matrix<double, 9, 9> CovarianceInWorld(const NavState& state) const;

 private:
  Eigen::Vector3d start_;
  Eigen::Vector3d up_B_ = Eigen::Vector3d::UnitZ();  // at the start
  Eigen::Quaterniond R_WM_ = Eigen::Quaterniond::Identity();
  double gravity_ = 9.81;  // m/s^2
};

}  // namespace chase::odometry
