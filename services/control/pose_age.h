#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

namespace chase::control {

/// Tells poses that were queued or held up on their way from those that come as usual: their stamps
/// lie further behind this host's clock than those of the others. Only differences count, so that
/// clocks may be set and may disagree.
class PoseAge {
 public:
  /// True for a pose stamped `utime` that is handled at `now`, us, when it comes `most` us later
  /// than usual.
  bool IsLate(int64_t utime, int64_t now, int64_t most) const {
    return usual_ && now - utime > *usual_ + most;
  }
  /// One that is gone by.
  void Take(int64_t utime, int64_t now) {
    usual_ = usual_ ? std::min(now - utime, *usual_ + kLeak) : now - utime;
  }
  void Reset() { usual_.reset(); }

 private:
  static constexpr int64_t kLeak = 1;  // us a pose: clocks drift by up to 200 us a second
  std::optional<int64_t> usual_;       // us
};

}  // namespace chase::control
