#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

namespace chase::control {

/// Tells poses that were queued or delayed: now - utime exceeds its running minimum. The two clocks
/// may differ by a constant; one that steps makes poses late until Reset().
class PoseAge {
 public:
  /// True for a pose stamped `utime` that is handled at `now`, us, when it comes `most` us later
  /// than usual.
  bool IsLate(int64_t utime, int64_t now, int64_t most) const {
    return usual_ && now - utime > *usual_ + most;
  }
  /// Records a pose that is used.
  void Take(int64_t utime, int64_t now) {
    const int64_t lag = now - utime;
    usual_ = usual_ ? std::clamp(lag, *usual_ - kGain, *usual_ + kLeak) : lag;
  }
  void Reset() { usual_.reset(); }

 private:
  static constexpr int64_t kLeak = 1;     // us a pose: clocks drift by up to 200 us a second
  static constexpr int64_t kGain = 1000;  // us a pose: one stamped ahead makes no others late
  std::optional<int64_t> usual_;          // us
};

}  // namespace chase::control
