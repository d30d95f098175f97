#include "services/lidar/gps_clock.h"

#include <cstdlib>

namespace chase::lidar {
namespace {

constexpr std::size_t kPositionBytes = 512, kPulseAt = 202;
constexpr int64_t kHour = 3'600'000'000, kStale = 5'000'000;  // us
constexpr int64_t kApart = 20'000;  // us: what IMU and camera, which the host stamps, may be off

}  // namespace

void GpsClock::Hear(const uint8_t* data, std::size_t size, int64_t utc) {
  if (size != kPositionBytes || data[kPulseAt] > 3) return;
  pulse_ = static_cast<Pulse>(data[kPulseAt]);
  heard_ = utc;
}

std::optional<int64_t> GpsClock::Utc(int64_t device_us, int64_t utc) const {
  if (pulse_ != Pulse::kLocked || utc - heard_ > kStale) return std::nullopt;
  const int64_t past = device_us % kHour;
  int64_t time = utc - utc % kHour + past;  // of the hours about, the nearest
  if (time - utc > kHour / 2) time -= kHour;
  if (utc - time > kHour / 2) time += kHour;
  if (std::llabs(time - utc) > kApart) return std::nullopt;
  return time;
}

std::string GpsClock::Problem(int64_t utc) const {
  if (heard_ == 0) return "no position packet of the sensor";
  if (utc - heard_ > kStale) return "the sensor's position packets have ceased";
  switch (pulse_) {
    case Pulse::kAbsent:
      return "the sensor has no pulse per second";
    case Pulse::kSynchronising:
      return "the sensor is not locked to its pulse per second yet";
    case Pulse::kError:
      return "the sensor's pulse per second is faulty";
    case Pulse::kLocked:
      break;
  }
  return "GPS time and this host's differ by more than 20 ms: set the host's clock (chrony)";
}

}  // namespace chase::lidar
