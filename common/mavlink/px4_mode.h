#pragma once

#include <cstdint>
#include <string>

namespace chase::mavlink {

/// PX4's mode as its heartbeat carries it (PX4-Autopilot, px4_custom_mode.h).
struct Mode {
  uint8_t main = 0, sub = 0;

  static Mode Of(uint32_t custom_mode) {
    return {static_cast<uint8_t>(custom_mode >> 16), static_cast<uint8_t>(custom_mode >> 24)};
  }
  uint32_t custom_mode() const {
    return static_cast<uint32_t>(main) << 16 | static_cast<uint32_t>(sub) << 24;
  }
  bool operator==(const Mode& o) const { return main == o.main && sub == o.sub; }
  std::string name() const;
};
/// Flown by a pilot: MANUAL, ALTCTL, POSCTL, ACRO, STABILIZED.
inline bool IsByStick(const Mode& mode) {
  return mode.main == 1 || mode.main == 2 || mode.main == 3 || mode.main == 5 || mode.main == 7;
}

inline constexpr Mode kOffboardMode{6, 0}, kLandMode{4, 6}, kHoldMode{4, 3}, kPositionMode{3, 0};

}  // namespace chase::mavlink
