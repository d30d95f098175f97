#pragma once

namespace chase::world {

/// What leads a body off its forecast: an acceleration of which no more is known than its deviation
/// and how fast it is forgotten (Singer 1970, "Estimating optimal tracking filter performance for
/// manned maneuvering targets").
struct Manoeuvre {
  double acceleration = 0.0;  ///< stationary standard deviation along an axis, m/s^2; 0: none
  double memory = 1.0;        ///< time constant of its correlation, s, > 0

  /// Of the place along an axis, t s after it went on steadily, m^2: the double integral of
  /// (t - s)(t - u) times the correlation. Its root, also where variances of a place and of a
  /// velocity are added, is convex in t, and over t^2 it grows: place and acceleration are
  /// correlated.
  double Variance(double t) const;
};

}  // namespace chase::world
