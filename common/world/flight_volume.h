#pragma once

namespace chase::world {

/// Heights above the ground below that plans keep to, and as far as mapping lists, m.
struct FlightVolume {
  double low = 0.6, high = 3.5;
  double listed = 3.9;  ///< high, and what of the body reaches beyond its plan
  double around = 9.0;  ///< plan view, from the drone
  double unseen = 3.0;  ///< as far from the drone places are listed of which nothing was seen
};
inline constexpr FlightVolume kFlightVolume;

}  // namespace chase::world
