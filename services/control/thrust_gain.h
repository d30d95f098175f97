#pragma once

#include <algorithm>

namespace chase::control {

/// What the motors give over what they are asked for: of weight, propellers and battery the
/// controller knows only what it was told. Least squares of the specific force along the body's z
/// axis over the thrust that was asked for, with exponential forgetting; after PX4's hover thrust
/// estimator. It reads the accelerometer alone, so a wrong pose does not wind it up.
class ThrustGain {
 public:
  /// `asked` has been asked for during the last `dt` s, and `felt` is measured now, m/s^2.
  void Add(double asked, double felt, double dt) {
    asked_ += std::min(1.0, dt / kMotorLag) * (asked - asked_);
    age_ += dt;
    const double share = dt / std::min(kMemory, kPrior + age_);
    squares_ += share * (asked_ * asked_ - squares_);
    product_ += share * (asked_ * felt - product_);
  }
  double value() const { return std::clamp(product_ / squares_, kLeast, 1.0 / kLeast); }

 private:
  static constexpr double kMotorLag = 0.05;  // s
  static constexpr double kMemory = 2.0;     // s: a hundred vibrations of 0.5 m/s^2 leave 0.5 %
  static constexpr double kPrior = 0.2;      // s that the first guess counts for
  static constexpr double kLeast = 0.6;      // a lost motor of six and a battery that is empty
  static constexpr double kWeight = 9.81;    // m/s^2: where it begins

  double age_ = 0.0, asked_ = kWeight, squares_ = kWeight * kWeight, product_ = kWeight * kWeight;
};

}  // namespace chase::control
