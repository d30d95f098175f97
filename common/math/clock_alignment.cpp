#include "common/math/clock_alignment.h"

#include <algorithm>
#include <cstdlib>

namespace chase::math {
namespace {
constexpr double kCreepPerSecond = 1e-4;
constexpr int64_t kJump = 1'000'000;     // us
constexpr int64_t kLateFor = 1'000'000;  // us
}  // namespace

void ClockAlignment::Add(int64_t device_us, int64_t arrival_utime) {
  const int64_t offset = arrival_utime - device_us;
  if (!started_ || std::llabs(offset - offset_us_) > kJump) {
    Begin(device_us, offset);
  } else if (late_us_ == 0 || offset <= offset_us_ + late_us_) {
    late_since_.reset();
  } else {
    least_late_us_ = late_since_ ? std::min(least_late_us_, offset) : offset;
    if (!late_since_) late_since_ = arrival_utime;
    if (arrival_utime - *late_since_ >= kLateFor) Begin(device_us, least_late_us_);
  }
  creep_us_ += kCreepPerSecond * static_cast<double>(device_us - last_device_us_);
  const auto whole = static_cast<int64_t>(creep_us_);
  creep_us_ -= static_cast<double>(whole);
  offset_us_ = std::min(offset, offset_us_ + whole);
  last_device_us_ = device_us;
}

void ClockAlignment::Begin(int64_t device_us, int64_t offset_us) {
  if (started_) ++restarts_;
  started_ = true;
  last_device_us_ = device_us;
  offset_us_ = offset_us;
  late_since_.reset();
}

}  // namespace chase::math
