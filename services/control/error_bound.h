#pragma once

#include <algorithm>
#include <cmath>

namespace chase::control {

/// How large the tracking error is with high confidence: its greatest value of the last 2 s, in
/// eighths, which are 400 poses and longer than the slowest mode of the loop (1.3 s for the default
/// gains).
class ErrorBound {
 public:
  void Add(double t, double error) {
    const double slot = std::floor(t / kSlot);
    for (double s = std::max(last_ + 1.0, slot - kSlots + 1.0); s <= slot; s += 1.0) At(s) = 0.0;
    last_ = std::max(last_, slot);
    At(last_) = std::max(At(last_), error);
  }
  double value() const { return *std::max_element(most_, most_ + kSlots); }

 private:
  static constexpr int kSlots = 8;
  static constexpr double kSlot = 0.25;  // s
  double& At(double slot) {
    return most_[static_cast<int>(slot - kSlots * std::floor(slot / kSlots))];
  }
  double last_ = -1e18;
  double most_[kSlots] = {};
};

}  // namespace chase::control
