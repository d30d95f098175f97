#pragma once

#include <deque>

#include "services/odometry/sweep.h"

namespace chase::odometry {

/// Tells how long a body that was at rest at the start has not moved. While it stands its velocity
/// is nothing and the gyroscope shows its bias. Any doubt ends it for good.
class Standing {
 public:
  /// Begins with what the inertial unit shows at rest: means and standard deviations of a sample,
  /// m/s^2 and rad/s, at `p` [m].
  void Begin(const ImuSample& mean, double accel_spread, double gyro_spread,
             const Eigen::Vector3d& p);

  void Add(const ImuSample& imu);
  /// A sweep saw the body at `p`.
  void See(const Eigen::Vector3d& p);

  bool holds() const { return holds_; }
  /// Mean of the newest samples, rad/s: the gyroscope's bias while it holds.
  const Eigen::Vector3d& gyro() const { return gyro_; }

 private:
  bool holds_ = false;
  Eigen::Vector3d p_ = Eigen::Vector3d::Zero(), gyro_ = Eigen::Vector3d::Zero();
  ImuSample mean_;
  double accel_limit_ = 0.0, gyro_limit_ = 0.0;
  std::deque<ImuSample> window_;
};

}  // namespace chase::odometry
