#pragma once

#include <Eigen/Core>
#include <vector>

#include "services/mapping/sweep.h"

namespace chase::mapping {

/// The nearest returns of a sweep by their direction in plan around the sensor, the ground's left
/// out: what hides what.
class Panorama {
 public:
  /// `owner[i]`: cluster of return i, or -1.
  void Take(const Eigen::Vector3d& origin, const std::vector<Return>& returns,
            const std::vector<int>& owner);
  /// True where something that is not `owner`'s stands in front of p, or beside the ray to it.
  bool Hides(const Eigen::Vector2d& p, int owner) const;
  const Eigen::Vector2d& origin() const { return origin_; }

 private:
  static constexpr int kBins = 1024;
  struct Bin {
    float first, second;  ///< m, of the nearest return and of the nearest of another owner
    int owner;            ///< of the first
  };
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  std::vector<Bin> bins_;
};

}  // namespace chase::mapping
