#pragma once

#include <vector>

namespace chase::world {

/// A stretch of a path: its length [m] and the speed that it allows [m/s]; at its end the motion
/// rests for `rest` [s], or goes on when that is negative.
struct Stretch {
  double length = 0.0, speed = 0.0, rest = -1.0;
};

/// Path length over time of the fastest motion from rest to rest that keeps the speeds of all
/// stretches and one acceleration [m/s^2] along the path, after a wait [s].
class SpeedProfile {
 public:
  SpeedProfile(const std::vector<Stretch>& stretches, double acceleration, double wait);

  double duration() const { return duration_; }  ///< s
  double LengthAt(double t) const;               ///< m, from 0
  double SpeedAt(double t) const;                ///< m/s
  /// Times at which it starts or comes to rest on the way, in order.
  const std::vector<double>& rests() const { return rests_; }

 private:
  /// From one speed to another over a length, faster in between where there is room for it.
  struct Ramp {
    double start, from, length;  // time, path length before it, its own length
    double speed, acceleration, first, last;

    double peak() const;
    double duration() const;
    double SpeedAt(double t) const;  // t from the ramp's start
    double LengthAt(double t) const;
  };
  const Ramp& At(double t) const;

  std::vector<Ramp> ramps_;
  std::vector<double> rests_;
  double duration_ = 0.0;
};

}  // namespace chase::world
