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
    if (!BeginPair()) return known_ ? spare_ : Radius() * std::sin(Angle());
    spare_ = Radius() * std::sin(Angle());
    known_ = true;
    return Radius() * std::cos(Angle());
  }

  /// What follows is as if one had been drawn, at a fraction of its price.
  void SkipGaussian() {
    if (BeginPair()) known_ = false;
  }

 private:
  static uint64_t Mix(uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }

  /// False where one of a pair is left, which goes.
  bool BeginPair() {
    has_spare_ = !has_spare_;
    if (!has_spare_) return false;
    u_ = Uniform();
    w_ = Uniform();
    return true;
  }
  double Radius() const { return std::sqrt(-2.0 * std::log(1.0 - u_)); }
  double Angle() const { return 6.283185307179586 * w_; }

  uint64_t state_;
  double u_ = 0.0, w_ = 0.0, spare_ = 0.0;
  bool has_spare_ = false, known_ = false;
};

}  // namespace chase::world
