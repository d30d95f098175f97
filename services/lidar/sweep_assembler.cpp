#include "services/lidar/sweep_assembler.h"

#include <algorithm>
#include <cmath>

namespace chase::lidar {
namespace {

constexpr int64_t kHourUs = 3'600'000'000;
constexpr int64_t kPauseUs = 1'000'000;
constexpr double kWholeDeg = 355.0;
constexpr double kWrapDeg = 180.0;
constexpr size_t kPointsPerSweep = 30000;

}  // namespace

int64_t SweepAssembler::Unwrap(uint32_t stamp_us) {
  if (last_raw_us_ && stamp_us<*last_raw_us_&& * last_raw_us_ - stamp_us> kHourUs / 2)
    hours_us_ += kHourUs;
  last_raw_us_ = stamp_us;
  return hours_us_ + stamp_us;
}

std::vector<Sweep> SweepAssembler::Add(const uint8_t* data, size_t size) {
  std::vector<Sweep> done;
  if (!PacketProblem(data, size).empty()) {
    ++malformed_;
    return done;
  }
  const auto verdict = model_.Add(data);
  if (verdict == ModelCheck::Verdict::kOther) return done;
  waiting_.emplace_back();
  std::copy(data, data + size, waiting_.back().begin());
  if (verdict == ModelCheck::Verdict::kUndecided) return done;
  for (const Bytes& bytes : waiting_) AddPacket(bytes.data(), &done);
  waiting_.clear();
  return done;
}

void SweepAssembler::AddPacket(const uint8_t* data, std::vector<Sweep>* done) {
  const Packet packet = Decode(data, config_.min_range, config_.max_range);
  const int64_t stamp_us = Unwrap(packet.stamp_us);
  CountLost(stamp_us, static_cast<double>(packet.firings.size()) * kFiringPeriod * 1e6);
  for (const Firing& firing : packet.firings) AddFiring(packet, firing, stamp_us, done);
}

/// A gap of a second and more is a sensor that paused, or a clock that was set: what came before
/// makes no sweep with what comes now.
void SweepAssembler::CountLost(int64_t stamp_us, double interval_us) {
  if (last_stamp_us_ && std::llabs(stamp_us - *last_stamp_us_) >= kPauseUs) {
    if (sweep_) ++broken_off_;
    sweep_.reset();
    last_turned_.reset();
  } else if (last_stamp_us_) {
    const double steps = static_cast<double>(stamp_us - *last_stamp_us_) / interval_us;
    lost_ += std::max(0L, std::lround(steps) - 1);
  }
  last_stamp_us_ = stamp_us;
}

/// Degrees from the cut to `azimuth_deg`, clockwise, [0, 360).
double SweepAssembler::Turned(double azimuth_deg) {
  if (!cut_deg_) cut_deg_ = config_.cut_azimuth_deg < 0.0 ? azimuth_deg : config_.cut_azimuth_deg;
  return std::fmod(azimuth_deg - *cut_deg_ + 720.0, 360.0);
}

void SweepAssembler::Begin(int64_t stamp_us, const Firing& firing) {
  sweep_.emplace();
  sweep_->points.reserve(kPointsPerSweep);
  sweep_->device_us = stamp_us + std::llround(firing.t * 1e6);
  start_turned_ = Turned(firing.azimuth_deg);
}

void SweepAssembler::AddFiring(const Packet& packet, const Firing& firing, int64_t stamp_us,
                               std::vector<Sweep>* done) {
  const double turned = Turned(firing.azimuth_deg);
  const bool at_cut = last_turned_ ? turned < *last_turned_ - kWrapDeg : turned == 0.0;
  last_turned_ = turned;
  if (at_cut) {
    if (sweep_) done->push_back(std::move(*sweep_));
    Begin(stamp_us, firing);
  }
  if (!sweep_) return;
  sweep_->covered_deg = turned - start_turned_;
  const double offset = static_cast<double>(stamp_us - sweep_->device_us) * 1e-6;
  for (size_t i = firing.begin; i < firing.end; ++i) {
    sweep_->points.push_back(packet.points[i]);
    sweep_->points.back().t = std::max(0.0, packet.points[i].t + offset);
  }
}

std::optional<Sweep> SweepAssembler::Finish() {
  std::optional<Sweep> last = std::move(sweep_);
  sweep_.reset();
  if (!last || last->covered_deg >= kWholeDeg) return last;
  ++broken_off_;
  return std::nullopt;
}

}  // namespace chase::lidar
