#pragma once

namespace chase::world {

/// How old an input may be before whoever needs it does without, s, and what is done then.
struct MostAge {
  double obstacles = 0.3;  ///< planning: brakes and hovers, uncertified
  double pose = 0.1;       ///< control: levels and sinks; after `velocity` it falls silent as well
  double velocity = 2.0;   ///< control: since odometry was usable; brakes until then, then lands
};
inline constexpr MostAge kMostAge;

}  // namespace chase::world
