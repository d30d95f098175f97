#pragma once

#include "services/odometry/error_state_filter.h"

namespace chase::odometry {

/// W seen from the frame M in which filter and map live. M is upright only as far as the
/// accelerometer could tell at the start, its bias included: 0.05 m/s^2 are 5 mrad, or half a metre
/// at a distance of 100 m. The filter learns gravity in M, and W is M turned upright about the
/// start. The turn is the smallest one, so that it changes no heading there.
class LevelFrame {
 public:
  /// M and W share the point `start` and agree on it.
  explicit LevelFrame(const Eigen::Vector3d& start) : start_(start) {}

  /// `g`: gravity in M, m/s^2; must not vanish.
  void SetGravity(const Eigen::Vector3d& g);

  const Eigen::Quaterniond& R_WM() const { return R_WM_; }
  Pose ToWorld(const Pose& X_MB) const { return {R_WM_ * X_MB.R, ToWorld(X_MB.p)}; }
  Eigen::Vector3d ToWorld(const Eigen::Vector3d& p_M) const {
    return start_ + R_WM_ * (p_M - start_);
  }

  /// Covariance of (p, v, rotation error) in W: that in M, and what is not known of gravity times
  /// the distance from the start.
  Eigen::Matrix<double, 9, 9> CovarianceInWorld(const NavState& state) const;

 private:
  Eigen::Vector3d start_;
  Eigen::Quaterniond R_WM_ = Eigen::Quaterniond::Identity();
  double gravity_ = 9.81;  // m/s^2
};

}  // namespace chase::odometry
