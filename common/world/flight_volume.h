#pragma once

namespace chase::world {

/// Heights above the ground below that plans keep to, and as far as mapping lists, m.
struct FlightVolume {
  double low = 0.6, high = 3.5;
  double listed = 3.9;  ///< high, and what of the body reaches beyond its plan
  double around = 9.0;  ///< plan view, from the drone
};
inline constexpr FlightVolume kFlightVolume;

}  // namespace chase::world
