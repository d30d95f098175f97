#pragma once

#include <cstdint>

namespace chase::lidar {

/// Puts the sensor's clock on the host's. A packet can only arrive late, so the smallest difference
/// of arrival and sensor time seen so far is the offset; it may creep up by 100 us a second so that
/// a slow sensor clock is followed too.
class ClockAlignment {
 public:
  void Add(int64_t device_us, int64_t arrival_utime);
  int64_t HostTime(int64_t device_us) const { return device_us + offset_us_; }

 private:
  bool started_ = false;
  int64_t offset_us_ = 0;
  int64_t last_device_us_ = 0;
  double creep_us_ = 0;
};

}  // namespace chase::lidar
