#pragma once

#include <cstdint>

namespace chase::math {

/// Puts a device's clock on the host's. What it sends can only arrive late, so the smallest
/// difference of arrival and device time seen so far is the offset; it may creep up by 100 us a
/// second so that a slow clock is followed too. A difference larger by a second is a clock that
/// was set or began anew: so does the offset.
class ClockAlignment {
 public:
  void Add(int64_t device_us, int64_t arrival_utime);
  int64_t HostTime(int64_t device_us) const { return device_us + offset_us_; }
  /// How often the device's clock began anew.
  int restarts() const { return restarts_; }

 private:
  bool started_ = false;
  int64_t offset_us_ = 0;
  int64_t last_device_us_ = 0;
  double creep_us_ = 0;
  int restarts_ = 0;
};

}  // namespace chase::math
