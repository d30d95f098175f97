#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <optional>

#include "services/fcu/conversions.h"

namespace chase::fcu {

/// Takes the thrust away once control has felt the ground. PX4 1.14 led by attitude calls itself
/// landed, and disarms, only after a second below MPC_MANTHR_MIN (MulticopterLandDetector.cpp).
/// Meanwhile the accelerometer is watched: on the ground it shows the weight whatever the motors
/// do, in the air their thrust alone.
class Touchdown {
 public:
  void Feel(const ImuSample& sample) {
    const double dt = 1e-6 * static_cast<double>(sample.utime - felt_utime_);
    felt_ += std::clamp(dt / kSmoothing, 0.0, 1.0) * (sample.accel - felt_);
    felt_utime_ = sample.utime;
  }
  /// Is the weight borne, by the ground or by the motors?
  bool IsBorne(int64_t utime) const { return Hears(utime) && !IsShort(); }
  /// By neither: that is the air.
  bool Falls(int64_t utime) const { return Hears(utime) && IsShort(); }

  /// The share of full thrust that is sent.
  void Flies(double share, int64_t utime) {
    share_ = share;
    utime_ = utime;
  }
  /// What to send next, where `hover` balances the weight.
  double Lower(double hover, int64_t utime) {
    const double dt = std::min(1e-6 * static_cast<double>(utime - utime_), kLongestStep);
    Flies(std::max(0.0, share_.value_or(hover) - hover * dt / kLoweredIn), utime);
    return *share_;
  }

 private:
  bool Hears(int64_t utime) const {
    return 1e-6 * static_cast<double>(utime - felt_utime_) <= kOldest;
  }
  bool IsShort() const { return felt_.norm() < kGravity - kShort; }

  static constexpr double kGravity = 9.81;      // m/s^2
  static constexpr double kLoweredIn = 0.5;     // s from the hover to none
  static constexpr double kLongestStep = 0.05;  // s, after a pause of the stream
  static constexpr double kSmoothing = 0.05;    // s: ten samples of a body that shakes
  // m/s^2. In the air it is missing 0.2 s after the thrust began to fall, which is at 60 % of the
  // hover then; the body sinks at 0.3 m/s.
  static constexpr double kShort = 2.0;
  static constexpr double kOldest = 0.1;  // s: twenty samples

  Eigen::Vector3d felt_ = Eigen::Vector3d::Zero();  // specific force, frame B, m/s^2
  int64_t felt_utime_ = 0;                          // us
  std::optional<double> share_;
  int64_t utime_ = 0;
};

}  // namespace chase::fcu
