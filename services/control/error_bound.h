#pragma once

#include <algorithm>
#include <cmath>

namespace chase::control {

/// How large the tracking error is with high confidence: a quarter more than its greatest value of
/// the last 2 s (400 poses, longer than the slowest mode of the loop), and a centimetre for the
/// manoeuvre to come. How many of the half seconds that follow keep below: in the gym 79 to 84 % by
/// the greatest value alone, all of 3200 with the centimetre; in gusts of 1.5 m/s about a wind of 3
/// m/s 94 % with the centimetre, 99.7 % with the quarter too (control_test).
class ErrorBound {
 public:
  /// `unknown`: the bound while the error has not been measured, m.
  explicit ErrorBound(double unknown) : unknown_((unknown - kMargin) / kGrowth) {
    std::fill(most_, most_ + kSlots, unknown_);
  }
  void Add(double t, double error) {
    const double slot = std::floor(t / kSlot);
    for (double s = std::max(last_ + 1.0, slot - kSlots + 1.0); s <= slot; s += 1.0)
      At(s) = s < slot ? unknown_ : 0.0;
    last_ = std::max(last_, slot);
    At(last_) = std::max(At(last_), error);
  }
  double value() const { return kGrowth * *std::max_element(most_, most_ + kSlots) + kMargin; }

 private:
  static constexpr int kSlots = 8;
  static constexpr double kSlot = 0.25;    // s
  static constexpr double kMargin = 0.01;  // m
  static constexpr double kGrowth = 1.25;
  double& At(double slot) {
    return most_[static_cast<int>(slot - kSlots * std::floor(slot / kSlots))];
  }
  double last_ = -1e18;
  double unknown_;  // error whose bound that is, m
  double most_[kSlots];
};

}  // namespace chase::control
