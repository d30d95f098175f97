#pragma once

#include <cstdint>

namespace chase::simulator {

// Independent streams of random numbers of one flight's seed, so that a change in one sensor leaves
// the others' noise alone.
inline constexpr uint64_t kWindStream = 1;
inline constexpr uint64_t kImuStream = 2;
inline constexpr uint64_t kLidarStream = 3;
inline constexpr uint64_t kCameraStream = 4;
inline constexpr uint64_t kFaultStream = 5;

}  // namespace chase::simulator
