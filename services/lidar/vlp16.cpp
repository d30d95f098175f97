#include "services/lidar/vlp16.h"

#include <cmath>

namespace chase::lidar {
namespace {

constexpr size_t kBlockBytes = 100;
constexpr double kRangeUnit = 0.002;  // m
constexpr double kDegree = M_PI / 180.0;

int Word(const uint8_t* p) { return p[0] | (p[1] << 8); }

const uint8_t* Block(const uint8_t* data, int block) {
  return data + kBlockBytes * static_cast<size_t>(block);
}

int AzimuthTicks(const uint8_t* data, int block) { return Word(Block(data, block) + 2); }

double Degrees(double azimuth) {
  const double a = std::fmod(azimuth, 360.0);
  return a < 0.0 ? a + 360.0 : a;
}

/// Advance of the azimuth from block i to block j, degrees; 0 when the two cannot be neighbours.
double Advance(const uint8_t* data, int i, int j) {
  const double step = ((AzimuthTicks(data, j) - AzimuthTicks(data, i) + 36000) % 36000) * 0.01;
  return step < 10.0 ? step : 0.0;
}

/// Degrees a second while block `i` fires; the last block carries on at the rate before it.
double AzimuthRate(const uint8_t* data, int i, int stride) {
  const int from = i + stride < kBlocks ? i : i - stride;
  return Advance(data, from, from + stride) / kBlockPeriod;
}

struct Laser {
  double cos_elevation, sin_elevation;
};

const std::array<Laser, kLasers>& Lasers() {
  static const auto table = [] {
    std::array<Laser, kLasers> lasers;
    for (size_t i = 0; i < lasers.size(); ++i)
      lasers[i] = {std::cos(kElevationDeg[i] * kDegree), std::sin(kElevationDeg[i] * kDegree)};
    return lasers;
  }();
  return table;
}

Point MakePoint(size_t laser, double range, double azimuth_deg, double t, uint8_t intensity) {
  const Laser& beam = Lasers()[laser];
  const double a = azimuth_deg * kDegree, flat = range * beam.cos_elevation;
  Point p;
  p.x = static_cast<float>(flat * std::cos(a));
  p.y = static_cast<float>(-flat * std::sin(a));
  p.z = static_cast<float>(range * beam.sin_elevation + kHeight[laser]);
  p.t = t;
  p.intensity = intensity;
  p.ring = static_cast<uint8_t>(RingOfLaser(static_cast<int>(laser)));
  return p;
}

struct Limits {
  double min_range, max_range;
};

/// Appends the returns of one firing; `first` is the same firing's other return or null.
void AddReturns(const uint8_t* returns, const uint8_t* first, double rate, const Firing& firing,
                const Limits& limits, std::vector<Point>* points) {
  for (size_t laser = 0; laser < kLasers; ++laser) {
    const uint8_t* r = returns + 3 * laser;
    const int ticks = Word(r);
    const double range = ticks * kRangeUnit;
    if (ticks == 0 || range < limits.min_range || range > limits.max_range) continue;
    if (first && Word(first + 3 * laser) == ticks) continue;
    const double dt = static_cast<double>(laser) * kLaserPeriod;
    points->push_back(MakePoint(laser, range, firing.azimuth_deg + rate * dt, firing.t + dt, r[2]));
  }
}

/// Decodes the block, or the pair of blocks of a dual packet, that begins at `block`.
void DecodeBlock(const uint8_t* data, int block, int stride, const Limits& limits, Packet* out) {
  const double rate = AzimuthRate(data, block, stride);
  for (int half = 0; half < 2; ++half) {
    const double into = half * kFiringPeriod;
    Firing firing;
    firing.azimuth_deg = Degrees(AzimuthTicks(data, block) * 0.01 + rate * into);
    const int slot = block / stride;  // a dual packet carries each firing twice
    firing.t = slot * kBlockPeriod + into;
    firing.begin = out->points.size();
    const uint8_t* first = nullptr;
    for (int k = 0; k < stride; ++k) {
      const uint8_t* returns = Block(data, block + k) + 4 + 3 * kLasers * half;
      AddReturns(returns, first, rate, firing, limits, &out->points);
      first = returns;
    }
    firing.end = out->points.size();
    out->firings.push_back(firing);
  }
}

}  // namespace

std::string PacketProblem(const uint8_t* data, size_t size) {
  if (size != kPacketBytes) return "a data packet has 1206 bytes, not " + std::to_string(size);
  for (int b = 0; b < kBlocks; ++b) {
    if (Word(Block(data, b)) != 0xEEFF)
      return "block " + std::to_string(b) + " does not begin with the flag FF EE";
    if (AzimuthTicks(data, b) >= 36000)
      return "block " + std::to_string(b) + " has an azimuth beyond 360 degrees";
  }
  return "";
}

uint32_t PacketStamp(const uint8_t* data) {
  const uint8_t* p = data + 1200;
  return static_cast<uint32_t>(Word(p)) | (static_cast<uint32_t>(Word(p + 2)) << 16);
}

int64_t PacketDuration(const uint8_t* data) {
  const bool dual = static_cast<ReturnMode>(data[1204]) == ReturnMode::kDual;
  return std::llround(1e6 * kBlocks * kBlockPeriod / (dual ? 2.0 : 1.0));
}

Packet Decode(const uint8_t* data, double min_range, double max_range) {
  Packet out;
  out.stamp_us = PacketStamp(data);
  out.mode = static_cast<ReturnMode>(data[1204]);
  out.product = data[1205];
  out.firings.reserve(2 * kBlocks);
  out.points.reserve(2 * kBlocks * kLasers);
  const int stride = out.mode == ReturnMode::kDual ? 2 : 1;
  for (int b = 0; b < kBlocks; b += stride)
    DecodeBlock(data, b, stride, {min_range, max_range}, &out);
  return out;
}

}  // namespace chase::lidar
