#pragma once

#include <deque>

#include "services/odometry/error_state_filter.h"

namespace chase::odometry {

/// Tells whether the body stands: at rest from the start, and again after a second in which the
/// inertial unit shows no more than its own noise and the estimate no motion. While it stands its
/// velocity is nothing and the gyroscope shows its bias. Any doubt ends it.
class Standing {
 public:
  /// Begins with what the inertial unit shows at rest: means and standard deviations of a sample,
  /// m/s^2 and rad/s, at `p` [m].
  void Begin(const ImuSample& mean, double accel_spread, double gyro_spread,
             const Eigen::Vector3d& p);

  /// `state`: as estimated when the sample came.
  void Add(const ImuSample& imu, const NavState& state);
  /// A sweep saw the body at `p`.
  void See(const Eigen::Vector3d& p);

  bool holds() const { return holds_; }
  /// Mean of the newest samples, rad/s: the gyroscope's bias while it holds.
  const Eigen::Vector3d& gyro() const { return gyro_; }

 private:
  /// Sums of samples.
  struct Block {
    Eigen::Vector3d accel = Eigen::Vector3d::Zero(), gyro = Eigen::Vector3d::Zero();
    Eigen::Vector3d accel2 = Eigen::Vector3d::Zero(), gyro2 = Eigen::Vector3d::Zero();
    int n = 0;
  };
  void Watch(const ImuSample& imu);
  void Close(const NavState& state);

  bool holds_ = false;
  Eigen::Vector3d p_ = Eigen::Vector3d::Zero(), gyro_ = Eigen::Vector3d::Zero();
  ImuSample mean_;
  double accel_limit_ = 0.0, gyro_limit_ = 0.0;
  std::deque<ImuSample> window_;
  Block block_;               // the newest samples of a body that moves
  std::deque<Block> blocks_;  // and those before, full
};

}  // namespace chase::odometry
