#pragma once

#include <algorithm>

namespace chase::world {

/// Heading and how fast it turns.
struct Yaw {
  double yaw = 0.0;   ///< rad
  double rate = 0.0;  ///< rad/s
};

/// `t` s after the beginning of a stop of `duration` s, which turns ever more slowly.
inline Yaw YawOnStop(const Yaw& first, double duration, double t) {
  const double s = std::min(t / duration, 1.0);
  return {first.yaw + first.rate * duration * (s - 0.5 * s * s), first.rate * (1.0 - s)};
}

}  // namespace chase::world
