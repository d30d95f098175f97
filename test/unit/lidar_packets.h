#pragma once

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdint>

#include "services/lidar/vlp16.h"

/// Hand-made VLP-16 packets for tests.
namespace chase::lidar::testing {

using Bytes = std::array<uint8_t, kPacketBytes>;

struct PacketSpec {
  double azimuth_deg = 0.0;   // of the first block
  double step_deg = 0.4;      // from block to block (dual: from pair to pair)
  double range = 10.0;        // of every laser, m
  double second_range = 0.0;  // dual: of every laser in the odd blocks, m
  uint32_t stamp_us = 0;
  uint8_t mode = 0x37, product = 0x22;
};

inline void PutWord(uint8_t* p, int value) {
  p[0] = static_cast<uint8_t>(value & 0xff);
  p[1] = static_cast<uint8_t>(value >> 8);
}

inline Bytes MakePacket(const PacketSpec& spec) {
  Bytes bytes{};
  const bool dual = spec.mode == 0x39;
  for (int b = 0; b < kBlocks; ++b) {
    uint8_t* block = bytes.data() + 100 * b;
    PutWord(block, 0xEEFF);
    const double azimuth = spec.azimuth_deg + spec.step_deg * (dual ? b / 2 : b);
    PutWord(block + 2, static_cast<int>(std::lround(azimuth * 100)) % 36000);
    const double range = dual && b % 2 == 1 ? spec.second_range : spec.range;
    for (int r = 0; r < 32; ++r) {
      PutWord(block + 4 + 3 * r, static_cast<int>(std::lround(range / 0.002)));
      block[4 + 3 * r + 2] = static_cast<uint8_t>(r);
    }
  }
  PutWord(bytes.data() + 1200, static_cast<int>(spec.stamp_us & 0xffff));
  PutWord(bytes.data() + 1202, static_cast<int>(spec.stamp_us >> 16));
  bytes[1204] = spec.mode;
  bytes[1205] = spec.product;
  return bytes;
}

/// Packet `k` of a sensor that turns at 10 Hz.
inline Bytes StreamPacket(int k, double first_azimuth_deg, uint32_t first_stamp_us) {
  PacketSpec spec;
  const double elapsed_us = k * 1327.104;
  spec.step_deg = 3600.0 * kBlockPeriod;
  spec.azimuth_deg = std::fmod(first_azimuth_deg + elapsed_us * 3600e-6, 360.0);
  spec.stamp_us = static_cast<uint32_t>(
      (first_stamp_us + static_cast<uint64_t>(std::llround(elapsed_us))) % 3600000000ull);
  return MakePacket(spec);
}

/// A port of UDP that nobody listens on.
inline int FreePort() {
  const int probe = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  socklen_t size = sizeof at;
  auto* address = reinterpret_cast<sockaddr*>(&at);
  const bool got = bind(probe, address, size) == 0 && getsockname(probe, address, &size) == 0;
  close(probe);
  return got ? ntohs(at.sin_port) : 0;
}

}  // namespace chase::lidar::testing
