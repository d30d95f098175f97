#pragma once

#include <Eigen/Core>
#include <cmath>

#include "common/world/random.h"

namespace chase::worlds {

using world::Random;

inline constexpr double kPi = 3.14159265358979323846;

/// lo to hi, both included.
inline int Whole(Random* random, int lo, int hi) {
  return lo + static_cast<int>(random->Uniform() * (hi - lo + 1));
}
inline bool Chance(Random* random, double probability) { return random->Uniform() < probability; }

/// Between lo and hi with a random sign.
inline double Signed(Random* random, double lo, double hi) {
  const double size = random->Uniform(lo, hi);
  return Chance(random, 0.5) ? size : -size;
}

inline double RoundTo(double value, double step) { return std::round(value / step) * step; }

inline Eigen::Vector2d Polar(double angle, double length) {
  return {length * std::cos(angle), length * std::sin(angle)};
}

}  // namespace chase::worlds
