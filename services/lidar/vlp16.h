#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

/// Velodyne VLP-16 data packets. Numbers are from the VLP-16 User Manual 63-9243 (chapter 9): a
/// packet is 12 blocks of 100 bytes and 6 bytes of stamp and factory data; a block is the flag
/// 0xEEFF, an azimuth in 0.01 degrees and two firings of 16 lasers at 2 mm and 8 bits.
namespace chase::lidar {

inline constexpr size_t kPacketBytes = 1206;
inline constexpr int kLasers = 16;
inline constexpr int kBlocks = 12;
inline constexpr double kLaserPeriod = 2.304e-6;    ///< from one laser to the next, s
inline constexpr double kFiringPeriod = 55.296e-6;  ///< of all 16 lasers and their recharge, s
inline constexpr double kBlockPeriod = 2.0 * kFiringPeriod;

/// Elevation of each laser in the packet's order, degrees.
inline constexpr std::array<double, kLasers> kElevationDeg = {-15, 1, -13, 3,  -11, 5,  -9, 7,
                                                              -7,  9, -5,  11, -3,  13, -1, 15};
/// Height of each laser's origin above the optical centre, m.
inline constexpr std::array<double, kLasers> kHeight = {
    0.0112, -0.0007, 0.0097, -0.0022, 0.0081, -0.0037, 0.0066, -0.0051,
    0.0051, -0.0066, 0.0037, -0.0081, 0.0022, -0.0097, 0.0007, -0.0112};

/// Ring 0 is the lowest elevation.
constexpr int RingOfLaser(int laser) { return laser % 2 == 0 ? laser / 2 : 8 + laser / 2; }

enum class ReturnMode : uint8_t { kStrongest = 0x37, kLast = 0x38, kDual = 0x39 };

/// One return. Frame L (x forward, y left, z up), m.
struct Point {
  float x = 0, y = 0, z = 0;
  double t = 0;  ///< firing time after the packet's stamp (in a sweep: after its start), s
  uint8_t intensity = 0;
  uint8_t ring = 0;
};

/// All lasers once. Its returns are points [begin, end) of the packet.
struct Firing {
  double azimuth_deg = 0;  ///< at the first laser, clockwise from forward, [0, 360)
  double t = 0;            ///< after the packet's stamp, s
  size_t begin = 0, end = 0;
};

struct Packet {
  uint32_t stamp_us = 0;  ///< of the first firing, microseconds past the hour
  ReturnMode mode = ReturnMode::kStrongest;
  uint8_t product = 0;  ///< factory byte: 0x22 VLP-16, 0x21 HDL-32E (and some VLP-16)
  std::vector<Firing> firings;
  std::vector<Point> points;
};

/// What makes these bytes no data packet, or an empty string.
std::string PacketProblem(const uint8_t* data, size_t size);

/// Microseconds past the hour of a packet that PacketProblem() passes.
uint32_t PacketStamp(const uint8_t* data);

/// From its first firing to the end of its last, microseconds.
int64_t PacketDuration(const uint8_t* data);

/// Decodes a packet that PacketProblem() passes. Azimuth advances between reported values at the
/// packet's own rate, down to the single laser. The second return of a dual packet is left out
/// where it repeats the first; ranges outside [min_range, max_range] m are left out.
Packet Decode(const uint8_t* data, double min_range, double max_range);

}  // namespace chase::lidar
