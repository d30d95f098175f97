#pragma once

#include <cmath>
#include <cstdint>

namespace chase::world {

/// A small generator whose numbers are the same with every library. Steele, Lea, Flood 2014
/// ("splitmix64"). Independent streams come from different `stream` numbers.
class Random {
 public:
  explicit Random(uint64_t seed, uint64_t stream = 0)
      : state_(Mix(seed * 0x9E3779B97F4A7C15ull + 1) ^ Mix(stream * 0xD1B54A32D192ED03ull + 2)) {}

  uint64_t Next() { return Mix(state_ += 0x9E3779B97F4A7C15ull); }

  /// In [0, 1).
  double Uniform() { return static_cast<double>(Next() >> 11) * 0x1p-53; }
  double Uniform(double lo, double hi) { return lo + (hi - lo) * Uniform(); }

  /// Standard normal, by Box and Muller.
  double Gaussian() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    const double r = std::sqrt(-2.0 * std::log(1.0 - Uniform()));
    const double angle = 6.283185307179586 * Uniform();
    spare_ = r * std::sin(angle);
    has_spare_ = true;
    return r * std::cos(angle);
  }

 private:
  static uint64_t Mix(uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }

  uint64_t state_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace chase::world
