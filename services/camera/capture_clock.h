#pragma once

#include <cstdint>

#include "common/math/clock_alignment.h"

namespace chase::camera {

/// When frames were captured, on the bus's clock. A stamp that claims to be of a clock of this host
/// is believed while the frame's age by it is possible; any other clock is aligned by the smallest
/// delay seen. Microseconds.
class CaptureClock {
 public:
  static constexpr int64_t kOldest = 1'000'000;  ///< age of a frame that is possible, us

  /// `stamp` as on the bus's clock where `of_host`, else on the device's own.
  int64_t HostTime(int64_t stamp, bool of_host, int64_t arrival);
  /// Where the wall clock by which stamps were put on the bus's was set since: as old as the frame
  /// before; other clocks are aligned anew.
  int64_t WithoutStamp(int64_t arrival);
  /// Was the last stamp of the host's clock believed?
  bool believed() const { return believed_; }

 private:
  math::ClockAlignment alignment_;
  bool believed_ = false;
  int64_t age_ = 0;  // of the last frame
};

}  // namespace chase::camera
