#pragma once

#include <Eigen/Core>
#include <vector>

namespace chase::world {

/// Motion along waypoints with rounded corners and a trapezoidal speed profile. At rest at its
/// start before t = 0 and at its end after Duration(). Frame W, m, s.
class PathMotion {
 public:
  PathMotion() = default;
  PathMotion(const std::vector<Eigen::Vector2d>& waypoints, double speed, double acceleration,
             double corner_radius);
  /// From samples (t, x, y) with growing t; cubic in between.
  explicit PathMotion(const std::vector<Eigen::Vector3d>& samples);

  Eigen::Vector2d Position(double t) const;
  Eigen::Vector2d Velocity(double t) const;
  double Duration() const { return t_.empty() ? 0.0 : t_.back(); }

 private:
  /// Index of the sample before t; t within [front, back].
  std::size_t Segment(double t) const;

  std::vector<double> t_;
  std::vector<Eigen::Vector2d> p_, v_;
};

}  // namespace chase::world
