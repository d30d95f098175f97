#include "services/simulator/sensor_faults.h"

#include <algorithm>
#include <cmath>

#include "services/simulator/streams.h"

namespace chase::simulator {
namespace {

// Full scale of a small MEMS unit such as the ICM-20689: 16 g and 2000 deg/s.
constexpr double kFullAccel = 16.0 * kGravity, kFullGyro = 2000.0 * M_PI / 180.0;

/// Every pixel is the mean of those to its right over `length` pixels, as of a turning camera.
void Blur(int length, Image* image) {
  const std::vector<uint8_t> sharp = image->rgb;
  for (int row = 0; row < image->height; ++row)
    for (int i = 0; i < 3 * image->width; ++i) {
      const int color = i % 3, first = i / 3, end = std::min(image->width, first + length);
      int sum = 0;
      for (int column = first; column < end; ++column)
        sum += sharp[static_cast<std::size_t>(3 * (row * image->width + column) + color)];
      image->rgb[static_cast<std::size_t>(3 * row * image->width + i)] =
          static_cast<uint8_t>(sum / (end - first));
    }
}

}  // namespace

SensorFaults::SensorFaults(const std::vector<world::FaultSpec>& faults, int64_t seed)
    : random_(static_cast<uint64_t>(seed), kFaultStream) {
  for (const world::FaultSpec& fault : faults)
    if (const world::FaultKind& kind = world::KindOf(fault); kind.victim == "simulator")
      entries_.push_back({world::Settled(fault, 0.0, 0, 0), &kind});
  const double direction = random_.Uniform(-M_PI, M_PI);
  gust_direction_ = {std::cos(direction), std::sin(direction), 0.0};
  motor_ = static_cast<int>(random_.Next() % 4);
}

std::vector<SensorFaults::Change> SensorFaults::Advance(double t) {
  t += 1e-6;  // a tick's time may lie a rounding below the one that is meant
  std::vector<Change> changes;
  for (Entry& entry : entries_) {
    const bool active = t >= entry.fault.at && t < entry.fault.at + entry.fault.duration;
    if (active != entry.active) changes.push_back({entry.fault.name, active});
    entry.active = active;
  }
  return changes;
}

const world::FaultKind* SensorFaults::Active(Effect effect) const {
  for (const Entry& entry : entries_)
    if (entry.active && entry.kind->effect == effect) return entry.kind;
  return nullptr;
}

double SensorFaults::LidarClock() const {
  const auto* step = Active(Effect::kLidarClock);
  return step ? step->amount : 0.0;
}

Disturbance SensorFaults::Disturbed() const {
  Disturbance disturbance;
  if (const auto* gust = Active(Effect::kGust)) disturbance.gust = gust->amount * gust_direction_;
  if (const auto* motor = Active(Effect::kMotor)) disturbance.motors[motor_] = motor->amount;
  disturbance.target_hidden = Active(Effect::kHide) != nullptr;
  disturbance.decoy = Active(Effect::kDecoy) != nullptr;
  return disturbance;
}

void SensorFaults::Strike(const ImuConfig& config, ImuSample* sample) {
  if (const auto* bias = Active(Effect::kImuBias)) {
    sample->accel.array() += bias->amount * config.accel_bias;
    sample->gyro.array() += bias->amount * config.gyro_bias;
  }
  const auto* spikes = Active(Effect::kImuSpikes);
  if (spikes == nullptr || random_.Uniform() >= spikes->amount) return;
  const uint64_t draw = random_.Next();
  const double sign = draw & 1 ? 1.0 : -1.0;
  const auto axis = static_cast<Eigen::Index>((draw >> 1) % 3);
  sample->accel[axis] = sign * kFullAccel;
  sample->gyro[axis] = sign * kFullGyro;
}

void SensorFaults::Strike(Image* image) const {
  if (const auto* blur = Active(Effect::kBlur))
    Blur(std::max(1, static_cast<int>(std::lround(blur->amount * image->width))), image);
  if (const auto* exposure = Active(Effect::kExposure))
    for (uint8_t& value : image->rgb)
      value = static_cast<uint8_t>(std::min(255.0, exposure->amount * value));
  if (Active(Effect::kBlackout)) std::fill(image->rgb.begin(), image->rgb.end(), uint8_t{0});
}

}  // namespace chase::simulator
