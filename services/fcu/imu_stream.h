#pragma once

#include <cstdint>
#include <optional>

#include "services/fcu/clock_sync.h"
#include "services/fcu/conversions.h"
#include "services/fcu/mavlink.h"

namespace chase::fcu {

/// Measurements of the autopilot's IMU on the host's clock, from the best message that comes:
/// HIGHRES_IMU (microseconds), else RAW_IMU, else SCALED_IMU (milliseconds). Stamps rise.
class ImuStream {
 public:
  /// The sample of the frame where it carries one that is to be used.
  std::optional<ImuSample> Take(const Frame& frame, const ClockSync& clock, int64_t utime);

  int64_t samples() const { return samples_; }
  /// Left out: no clock yet, stamps that do not rise or lie off by more than a second.
  int64_t refused() const { return refused_; }
  const char* source() const;

 private:
  static constexpr int kSources = 3;
  bool IsBest(int source, int64_t utime);

  int64_t heard_[kSources] = {};  // utime of the last message of each
  int best_ = -1;
  int64_t last_ = 0;  // stamp
  int restarts_ = 0;
  int64_t samples_ = 0, refused_ = 0;
};

}  // namespace chase::fcu
