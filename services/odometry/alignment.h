#pragma once

#include <deque>
#include <vector>

#include "services/odometry/error_state_filter.h"

namespace chase::odometry {

struct AlignmentConfig {
  double duration = 0.5;     ///< s
  double patience = 2.0;     ///< s
  double still_rate = 0.05;  ///< largest spread and mean of the gyro at rest, rad/s
  double still_accel = 0.6;  ///< largest spread of the accelerometer at rest, m/s^2

  template <class V>
  void Visit(V& v) {
    v("duration", duration, "of inertial samples averaged at the start, s");
    v("patience", patience, "a body that is settling is waited for so long, s");
    v("still_rate", still_rate, "largest spread and mean of the gyro at rest, rad/s");
    v("still_accel", still_accel, "largest spread of the accelerometer at rest, m/s^2");
  }
};

/// What a stretch of inertial samples has in common.
struct ImuStatistics {
  ImuSample mean;                                ///< `t` is the last sample's
  double accel_spread = 0.0, gyro_spread = 0.0;  ///< largest standard deviation of an axis
};

/// Averages the newest inertial samples to find where up is and how the gyro is biased. A body that
/// comes to rest meanwhile is waited for; one that flies is not.
class Alignment {
 public:
  explicit Alignment(const AlignmentConfig& config) : config_(config) {}

  void Add(const ImuSample& imu);
  bool Complete() const;
  bool AtRest() const { return AtRest(statistics()); }
  ImuStatistics statistics() const { return Statistics(0, window_.size()); }

  /// State at the last sample, level, of a body at rest that had heading `yaw` [rad] and position
  /// `p` [m, frame M] at the first one.
  NavState Result(const FilterConfig& filter, const Eigen::Vector3d& p, double yaw) const;

  /// State at the first sample of a body in motion, which had that heading and position then. Up is
  /// the mean of the felt force; velocity, biases and gravity's direction are open.
  NavState InMotion(const FilterConfig& filter, const Eigen::Vector3d& p, double yaw) const;
  /// The same, as open, about what `first` says of that sample.
  NavState InMotion(const FilterConfig& filter, const Eigen::Vector3d& p, double yaw,
                    const NavState& first) const;

  /// `last`, a state at the last sample, taken back to the first one.
  NavState AtFirst(const FilterConfig& filter, NavState last) const;
  const std::vector<ImuSample>& samples() const { return all_; }
  /// Since when the samples count as of a body at rest [s].
  double window_start() const { return window_.front().t; }

  /// State of a body whose pose and velocity are known from sweeps: only gravity is found.
  NavState ResultAt(const FilterConfig& filter, const NavState& known) const;

 private:
  ImuStatistics Statistics(size_t begin, size_t end) const;
  bool AtRest(const ImuStatistics& s) const;
  NavState Opened(const FilterConfig& filter, const Eigen::Vector3d& p, double yaw,
                  NavState state) const;
  void SetBiases(const FilterConfig& filter, NavState* state) const;
  void CoupleTiltAndBias(const FilterConfig& filter, NavState* state) const;

  AlignmentConfig config_;
  double first_t_ = 0.0;
  std::vector<ImuSample> all_;    // since the start, or the last gap
  std::deque<ImuSample> window_;  // the newest
};

}  // namespace chase::odometry
