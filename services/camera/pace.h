#pragma once

#include <cstdint>

namespace chase::camera {

/// Thins frames out to a rate, on average, whatever theirs is. Microseconds.
class Pace {
 public:
  explicit Pace(int64_t period) : period_(period) {}

  /// Is the frame captured at `utime` one to publish? The one after a pause is.
  bool Take(int64_t utime) {
    if (utime < due_ - kJitter) return false;
    due_ = (utime - due_ > period_ ? utime : due_) + period_;
    return true;
  }
  /// The clock of the frames began anew.
  void Restart() { due_ = 0; }

 private:
  static constexpr int64_t kJitter = 5'000;  // of capture stamps

  int64_t period_, due_ = 0;
};

}  // namespace chase::camera
