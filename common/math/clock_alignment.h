#pragma once

#include <cstdint>
#include <optional>

namespace chase::math {

/// Puts a device's clock on the host's. What it sends can only arrive late, so the smallest
/// difference of arrival and device time seen so far is the offset; it may creep up by 100 us a
/// second so that a slow clock is followed too. The offset begins anew with a clock that was set or
/// began anew: a difference is off by a second.
class ClockAlignment {
 public:
  /// `late_us`, above 0: it also begins anew where all differences are larger by so much for a
  /// second; for what does not wait that long on its way, as decoded video may.
  explicit ClockAlignment(int64_t late_us = 0) : late_us_(late_us) {}

  void Add(int64_t device_us, int64_t arrival_utime);
  int64_t HostTime(int64_t device_us) const { return device_us + offset_us_; }
  /// How often the offset began anew.
  int restarts() const { return restarts_; }

 private:
  void Begin(int64_t device_us, int64_t offset_us);

  int64_t late_us_;
  bool started_ = false;
  int64_t offset_us_ = 0;
  int64_t last_device_us_ = 0;
  double creep_us_ = 0;
  std::optional<int64_t> late_since_;  // utime from which on all differences are larger
  int64_t least_late_us_ = 0;          // of these the smallest
  int restarts_ = 0;
};

}  // namespace chase::math
