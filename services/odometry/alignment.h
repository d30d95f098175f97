#pragma once

#include <optional>

#include "services/odometry/error_state_filter.h"

namespace chase::odometry {

struct AlignmentConfig {
  double duration = 0.5;     ///< s
  double still_rate = 0.05;  ///< largest spread and mean of the gyro at rest, rad/s
  double still_accel = 0.6;  ///< largest spread of the accelerometer at rest, m/s^2

  template <class V>
  void Visit(V& v) {
    v("duration", duration, "of inertial samples averaged at the start, s");
    v("still_rate", still_rate, "largest spread and mean of the gyro at rest, rad/s");
    v("still_accel", still_accel, "largest spread of the accelerometer at rest, m/s^2");
  }
};

/// Averages the first inertial samples to find where up is and how the gyro is biased.
class Alignment {
 public:
  explicit Alignment(const AlignmentConfig& config) : config_(config) {}

  void Add(const ImuSample& imu);
  bool Complete() const;
  bool AtRest() const;
  double t() const { return last_.t; }

  /// State at the last sample: level at heading `yaw` [rad] and position `p` [m, frame W]. In
  /// motion the gyro's bias is unknown and up is the mean of the felt force.
  NavState Result(const FilterConfig& filter, const Eigen::Vector3d& p, double yaw) const;

  /// The same for a body whose pose and velocity are known from sweeps: only gravity is found.
  NavState ResultAt(const FilterConfig& filter, const NavState& known) const;

 private:
  Eigen::Vector3d MeanAccel() const { return sum_accel_ / n_; }
  Eigen::Vector3d MeanGyro() const { return sum_gyro_ / n_; }
  void SetBiasCovariance(const FilterConfig& filter, NavState* state) const;

  AlignmentConfig config_;
  double first_t_ = 0.0;
  ImuSample last_;
  double n_ = 0.0;
  Eigen::Vector3d sum_accel_ = Eigen::Vector3d::Zero(), sum_gyro_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d squares_accel_ = Eigen::Vector3d::Zero(), squares_gyro_ = Eigen::Vector3d::Zero();
};

}  // namespace chase::odometry
