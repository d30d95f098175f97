#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace chase::world {

/// How fast a motion along waypoints may be.
struct PathLimits {
  double speed = 1.0;         ///< greatest, m/s
  double acceleration = 0.5;  ///< along the path, m/s^2
  double lateral = 0.0;       ///< across it, in corners, m/s^2; 0: corners do not slow it down
};

/// Motion along waypoints with rounded corners and a trapezoidal speed profile. At rest at its
/// start before t = 0 and at its end after Duration(). Frame W, m, s.
class PathMotion {
 public:
  /// Rests on a waypoint [index] for some time [s, 0 or more]; there it turns on the spot.
  using Stops = std::vector<std::pair<int, double>>;

  PathMotion() = default;
  PathMotion(const std::vector<Eigen::Vector2d>& waypoints, double speed, double acceleration,
             double corner_radius)
      : PathMotion(waypoints, PathLimits{speed, acceleration, 0.0}, corner_radius, {}) {}
  PathMotion(const std::vector<Eigen::Vector2d>& waypoints, const PathLimits& limits,
             double corner_radius, const Stops& stops);
  /// From samples (t, x, y) with growing t; cubic in between.
  explicit PathMotion(const std::vector<Eigen::Vector3d>& samples);

  Eigen::Vector2d Position(double t) const;
  Eigen::Vector2d Velocity(double t) const;
  /// Unit vector of travel; at rest, of the travel before, at the start of the travel after. Zero
  /// if it never moves.
  Eigen::Vector2d Direction(double t) const;
  double Duration() const { return t_.empty() ? 0.0 : t_.back(); }

 private:
  /// Index of the sample before t; t within [front, back] of two samples or more.
  std::size_t Segment(double t) const;

  std::vector<double> t_;
  std::vector<Eigen::Vector2d> p_, v_;
};

}  // namespace chase::world
