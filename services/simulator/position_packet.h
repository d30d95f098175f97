#pragma once

#include <array>
#include <cstdint>

namespace chase::simulator {

/// A VLP-16's position packet (VLP-16 User Manual 63-9243, chapter 9): microseconds past the hour
/// of its clock, whether a pulse per second holds it, and the GPS receiver's sentence, which says
/// longitude and latitude zero. `clock_us`: since its power-on, and UTC since 1970 where `locked`.
std::array<uint8_t, 512> PositionPacket(int64_t clock_us, bool locked);

}  // namespace chase::simulator
