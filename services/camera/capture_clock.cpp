#include "services/camera/capture_clock.h"

namespace chase::camera {
namespace {

constexpr int64_t kYoungest = -5'000, kOldest = 1'000'000;  // ages that are possible, us

}  // namespace

int64_t CaptureClock::HostTime(int64_t stamp, bool of_host, int64_t arrival) {
  alignment_.Add(stamp, arrival);
  const int64_t age = arrival - stamp;
  believed_ = of_host && age >= kYoungest && age <= kOldest;
  return believed_ ? stamp : alignment_.HostTime(stamp);
}

}  // namespace chase::camera
