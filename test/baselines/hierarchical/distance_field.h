#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/world/obstacle.h"

namespace chase::baselines {

/// Planar distance to the nearest obstacle's surface on a grid, cut at a largest value. Upright
/// obstacles: the same at every height.
class DistanceField {
 public:
  DistanceField() = default;
  DistanceField(const std::vector<world::Obstacle>& obstacles, double cell, double cut);

  /// Bilinear; the cut value outside the grid.
  double At(const Eigen::Vector2d& p) const;
  /// Smallest value along a segment, sampled at the cell's spacing, both ends included; stops early
  /// below `enough`.
  double LeastAlong(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double enough) const;

  /// Whether the field was made from these very obstacles.
  bool IsOf(const std::vector<world::Obstacle>& obstacles) const;

 private:
  double cell_ = 1.0, cut_ = 0.0;
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  int nx_ = 0, ny_ = 0;
  std::vector<double> value_;
  std::vector<Eigen::Vector3d> circles_;  // x, y, radius
};

}  // namespace chase::baselines
