#include "services/camera/capture_clock.h"

namespace chase::camera {
namespace {

constexpr int64_t kYoungest = -5'000;  // age that is possible, us

}  // namespace

int64_t CaptureClock::HostTime(int64_t stamp, bool of_host, int64_t arrival) {
  alignment_.Add(stamp, arrival);
  const int64_t age = arrival - stamp;
  believed_ = of_host && age >= kYoungest && age <= kOldest;
  const int64_t utime = believed_ ? stamp : alignment_.HostTime(stamp);
  age_ = arrival - utime;
  return utime;
}

int64_t CaptureClock::WithoutStamp(int64_t arrival) {
  alignment_ = math::ClockAlignment();
  return arrival - age_;
}

}  // namespace chase::camera
