#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

/// Data packets as a VLP-16 sends them (VLP-16 User Manual 63-9243, chapter 9): 12 blocks of a
/// flag, an azimuth in 0.01 degrees and two firing sequences, then microseconds past the hour.
namespace chase::simulator {

inline constexpr int kFiringsPerPacket = 24;

struct DataPacket {
  double start = 0.0;  ///< of its first firing, s after power-on
  std::array<uint8_t, 1206> bytes{};

  /// Microseconds past the hour of the sensor's clock.
  void SetStamp(int64_t clock_us);
};

/// Height of a ring's laser above the sensor's optical centre, m.
float LaserHeight(int ring);

/// Firing sequences to packets of strongest returns.
class PacketWriter {
 public:
  /// The firing at `azimuth_deg` begins at t [s]; clockwise from forward.
  void Begin(double t, double azimuth_deg);
  /// A return of that firing; `range` in m, to the sensor's 2 mm.
  void Add(int ring, double range, uint8_t intensity);
  /// After its last laser. The packet where it is full now.
  void End();
  std::vector<DataPacket> Take() { return std::exchange(done_, {}); }

 private:
  DataPacket packet_;
  int firing_ = 0;  // in the packet
  std::vector<DataPacket> done_;
};

}  // namespace chase::simulator
