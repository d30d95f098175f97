#include "services/fcu/imu_stream.h"

#include <cstdlib>

namespace chase::fcu {
namespace {

constexpr int64_t kSilence = 500'000;     // us after which a worse source speaks
constexpr int64_t kMostOff = 1'000'000;   // us between a stamp and now
constexpr uint16_t kAccelAndGyro = 0x3F;  // bits of fields_updated

struct Measured {
  int source;  // 0: best
  ImuSample sample;
};

std::optional<Measured> Read(const Frame& frame) {
  if (const auto m = As<mav::HighresImu>(frame)) {
    if (m->id != 0 || (m->fields_updated & kAccelAndGyro) != kAccelAndGyro) return std::nullopt;
    return Measured{0, FromMessage(*m)};
  }
  if (const auto m = As<mav::RawImu>(frame)) return Measured{1, FromMessage(*m)};
  if (const auto m = As<mav::ScaledImu>(frame)) return Measured{2, FromMessage(*m)};
  return std::nullopt;
}

}  // namespace

bool ImuStream::IsBest(int source, int64_t utime) {
  heard_[source] = utime;
  for (int better = 0; better < source; ++better)
    if (heard_[better] != 0 && utime - heard_[better] < kSilence) return false;
  best_ = source;
  return true;
}

std::optional<ImuSample> ImuStream::Take(const Frame& frame, const ClockSync& clock,
                                         int64_t utime) {
  auto measured = Read(frame);
  if (!measured || !IsBest(measured->source, utime)) return std::nullopt;
  if (clock.restarts() != restarts_) restarts_ = clock.restarts(), last_ = 0;
  ImuSample& sample = measured->sample;
  const std::optional<int64_t> stamp = clock.HostTime(sample.utime);
  const bool good = stamp && *stamp > last_ && std::llabs(*stamp - utime) < kMostOff &&
                    sample.accel.allFinite() && sample.gyro.allFinite();
  if (!good) {
    ++refused_;
    return std::nullopt;
  }
  last_ = sample.utime = *stamp;
  ++samples_;
  return sample;
}

const char* ImuStream::source() const {
  static const char* const names[] = {"no IMU", "HIGHRES_IMU", "RAW_IMU", "SCALED_IMU"};
  return names[best_ + 1];
}

}  // namespace chase::fcu
