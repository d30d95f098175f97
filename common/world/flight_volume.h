#pragma once

namespace chase::world {

/// Heights above the ground below that plans keep to, and up to which mapping lists, m.
struct FlightVolume {
  double low = 0.6, high = 3.5;
  double listed = 3.9;  ///< high, and what of the body reaches beyond its plan
};
inline constexpr FlightVolume kFlightVolume;

}  // namespace chase::world
