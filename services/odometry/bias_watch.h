#pragma once

#include <optional>

#include "services/odometry/imu_buffer.h"

namespace chase::odometry {

/// Tells a step of the inertial unit's biases from a match that is off: both make an innovation
/// which the filter does not explain. A rival filter that begins before the first such innovation
/// with its biases open is compared with it, sweep by sweep, until the ratio of their likelihoods
/// speaks: Page 1954, "Continuous inspection schemes"; for filters, Willsky & Jones 1976, "A
/// generalized likelihood ratio approach".
class BiasWatch {
 public:
  explicit BiasWatch(const FilterConfig& config) : config_(config) {}

  /// A match `z` at `t` [s] to which the filter's update answered `kept`; `before`: the filter's
  /// state at the last sweep, from which `imu` leads to `t`. The state to go on from if the biases
  /// have stepped.
  std::optional<NavState> Judge(const ImuBuffer& imu, const NavState& before, double t,
                                const PoseMeasurement& z, const UpdateResult& kept);
  bool undecided() const { return rival_.has_value(); }
  void Forget() { rival_.reset(); }

 private:
  FilterConfig config_;
  std::optional<NavState> rival_;  // at the last sweep
  double evidence_ = 0.0;          // logarithm of the likelihood ratio, for the rival
};

}  // namespace chase::odometry
