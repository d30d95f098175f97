#pragma once

#include <optional>
#include <vector>

#include "services/odometry/sweep.h"

namespace chase::odometry {

struct SpikeConfig {
  double full_accel = 150.0;  ///< m/s^2
  double full_rate = 33.0;    ///< rad/s
  double accel_jump = 30.0;   ///< m/s^2
  double rate_jump = 2.0;     ///< rad/s

  template <class V>
  void Visit(V& v) {
    v("full_accel", full_accel, "readings from here on are at the end of the scale (16 g), m/s^2");
    v("full_rate", full_rate, "the same of the gyroscope (2000 deg/s), rad/s");
    v("accel_jump", accel_jump, "more from sample to sample takes a second one to believe, m/s^2");
    v("rate_jump", rate_jump, "the same of the gyroscope, rad/s");
  }
};

/// Leaves out inertial samples that no body makes: readings at the end of the unit's scale on any
/// axis, and single ones that neither neighbour bears out (the median of three, without its delay
/// for the others). A jump that the next sample confirms, such as a touchdown's, is one sample
/// late.
class SpikeFilter {
 public:
  explicit SpikeFilter(const SpikeConfig& config) : config_(config) {}

  /// What may be used by now, in order of time. Samples come in order and are finite.
  std::vector<ImuSample> Take(const ImuSample& imu);

 private:
  bool Saturated(const ImuSample& imu) const;
  bool Near(const ImuSample& a, const ImuSample& b) const;

  SpikeConfig config_;
  std::optional<ImuSample> last_, waiting_;  // the newest that was passed on; one that jumped since
};

}  // namespace chase::odometry
