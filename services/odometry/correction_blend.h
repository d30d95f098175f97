#pragma once

#include "services/odometry/sweep.h"

namespace chase::odometry {

struct BlendConfig {
  double time_constant = 0.05;  ///< s
  double position_rate = 0.4;   ///< fastest correction, m/s: 2 mm a sample at 200 Hz
  double rotation_rate = 0.4;   ///< rad/s
  double velocity_rate = 4.0;   ///< m/s^2
  double flag_position = 0.05;  ///< a rest above this is flagged as a correction, m

  template <class V>
  void Visit(V& v) {
    v("time_constant", time_constant, "of the decay of a correction, s");
    v("position_rate", position_rate, "fastest correction, m/s");
    v("rotation_rate", rotation_rate, "fastest correction, rad/s");
    v("velocity_rate", velocity_rate, "fastest correction, m/s^2");
    v("flag_position", flag_position, "a rest above this is flagged as a correction, m");
  }
};

/// Spreads the filter's jumps over time, so that whoever flies on the pose sees none.
class CorrectionBlend {
 public:
  explicit CorrectionBlend(const BlendConfig& config) : config_(config) {}

  /// What is put out stays where it was while the estimate moves from `before` to `after`.
  void Absorb(const Pose& before, const Eigen::Vector3d& v_before, const Pose& after,
              const Eigen::Vector3d& v_after);

  /// Lets the rest decay over `dt` s.
  void Decay(double dt);

  Pose Applied(const Pose& X_WB) const;
  Eigen::Vector3d AppliedVelocity(const Eigen::Vector3d& v_WB) const { return v_WB + dv_; }
  /// What is put out lies off the estimate by this on purpose: (p, v, rotation).
  Eigen::Matrix<double, 9, 1> rest() const {
    return (Eigen::Matrix<double, 9, 1>() << dp_, dv_, dtheta_).finished();
  }
  bool correcting() const { return dp_.norm() > config_.flag_position; }

 private:
  BlendConfig config_;
  Eigen::Vector3d dp_ = Eigen::Vector3d::Zero();      // put out minus estimate, frame W, m
  Eigen::Vector3d dv_ = Eigen::Vector3d::Zero();      // m/s
  Eigen::Vector3d dtheta_ = Eigen::Vector3d::Zero();  // rotation vector in W, rad
};

}  // namespace chase::odometry
