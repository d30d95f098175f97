#pragma once

#include "common/world/ages.h"

namespace chase::world {

/// Good sweeps in a row, which take-off waits for: each listed what it saw while odometry was well.
class SweepRun {
 public:
  static constexpr int kEnough = 10;

  /// A sweep of time t, s.
  void Add(double t, bool good) {
    const bool goes_on = IsFresh(t - newest_, kMostAge.obstacles);
    count_ = good ? (goes_on ? count_ : 0) + 1 : 0;
    newest_ = t;
  }
  int count() const { return count_; }
  bool IsEnough() const { return count_ >= kEnough; }

 private:
  int count_ = 0;
  double newest_ = -1e9;  // s
};

}  // namespace chase::world
