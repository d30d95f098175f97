#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace chase::lidar {

/// The time of a sensor that a GPS receiver with a pulse per second disciplines: its stamps are
/// then microseconds past the hour of UTC. Whether it is, the sensor says in its position packets
/// (VLP-16 User Manual 63-9243, chapter 9).
class GpsClock {
 public:
  /// A position packet; what is none is passed over.
  void Hear(const uint8_t* data, std::size_t size, int64_t utc);

  /// UTC, microseconds since 1970, of a stamp that arrived about `utc`; none while the pulse is not
  /// locked, its word is older than 5 s, or the two are 20 ms apart.
  std::optional<int64_t> Utc(int64_t device_us, int64_t utc) const;

  /// Why there is no time of it, in words.
  std::string Problem(int64_t utc) const;

 private:
  enum class Pulse : uint8_t { kAbsent, kSynchronising, kLocked, kError };
  Pulse pulse_ = Pulse::kAbsent;
  int64_t heard_ = 0;
};

}  // namespace chase::lidar
