#include "common/math/clock_alignment.h"

#include <algorithm>

namespace chase::math {
namespace {
constexpr double kCreepPerSecond = 1e-4;
constexpr int64_t kJump = 1'000'000;  // us
}  // namespace

void ClockAlignment::Add(int64_t device_us, int64_t arrival_utime) {
  const int64_t offset = arrival_utime - device_us;
  const bool jumped = started_ && (offset > offset_us_ + kJump || offset < offset_us_ - kJump);
  if (jumped) ++restarts_;
  if (!started_ || jumped) {
    started_ = true;
    offset_us_ = offset;
  } else {
    creep_us_ += kCreepPerSecond * static_cast<double>(device_us - last_device_us_);
    const auto whole = static_cast<int64_t>(creep_us_);
    creep_us_ -= static_cast<double>(whole);
    offset_us_ = std::min(offset, offset_us_ + whole);
  }
  last_device_us_ = device_us;
}

}  // namespace chase::math
