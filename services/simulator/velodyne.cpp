#include "services/simulator/velodyne.h"

#include <cmath>

namespace chase::simulator {
namespace {

constexpr double kRangeUnit = 0.002;  // m
constexpr int64_t kHour = 3'600'000'000;
constexpr uint8_t kStrongest = 0x37, kVlp16 = 0x22;
constexpr std::size_t kBlockBytes = 100, kStampAt = 1200;

void PutWord(uint8_t* at, unsigned value) {
  at[0] = static_cast<uint8_t>(value);
  at[1] = static_cast<uint8_t>(value >> 8);
}

}  // namespace

float LaserHeight(int ring) {
  // Table 9-1, from the lowest elevation to the highest.
  static constexpr float heights[] = {0.0112f,  0.0097f,  0.0081f,  0.0066f,  0.0051f,  0.0037f,
                                      0.0022f,  0.0007f,  -0.0007f, -0.0022f, -0.0037f, -0.0051f,
                                      -0.0066f, -0.0081f, -0.0097f, -0.0112f};
  return heights[ring];
}

void DataPacket::SetStamp(int64_t clock_us) {
  const auto stamp = static_cast<unsigned>(clock_us % kHour);
  PutWord(&bytes[kStampAt], stamp & 0xFFFF);
  PutWord(&bytes[kStampAt + 2], stamp >> 16);
}

void PacketWriter::Begin(double t, double azimuth_deg) {
  if (firing_ == 0) {
    packet_ = {};
    packet_.start = t;
    packet_.bytes[kStampAt + 4] = kStrongest;
    packet_.bytes[kStampAt + 5] = kVlp16;
  }
  if (firing_ % 2 != 0) return;
  uint8_t* block = &packet_.bytes[kBlockBytes * static_cast<std::size_t>(firing_ / 2)];
  PutWord(block, 0xEEFF);
  PutWord(block + 2, static_cast<unsigned>(std::lround(100.0 * azimuth_deg)) % 36000);
}

void PacketWriter::Add(int ring, double range, uint8_t intensity) {
  const int laser = ring < 8 ? 2 * ring : 2 * (ring - 8) + 1;
  uint8_t* block = &packet_.bytes[kBlockBytes * static_cast<std::size_t>(firing_ / 2)];
  uint8_t* at = block + 4 + 48 * (firing_ % 2) + 3 * laser;
  PutWord(at, static_cast<unsigned>(std::lround(range / kRangeUnit)));
  at[2] = intensity;
}

void PacketWriter::End() {
  if (++firing_ < kFiringsPerPacket) return;
  firing_ = 0;
  done_.push_back(packet_);
}

}  // namespace chase::simulator
