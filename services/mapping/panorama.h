#pragma once

#include <Eigen/Core>
#include <vector>

#include "services/mapping/sweep.h"

namespace chase::mapping {

/// The nearest returns of a sweep by their direction in plan around the sensor, the ground's left
/// out: what hides what. And how low rays passed that went farther: what would have been seen.
class Panorama {
 public:
  /// `owner[i]`: cluster of return i, or -1.
  void Take(const Eigen::Vector3d& origin, const std::vector<Return>& returns,
            const std::vector<int>& owner);
  /// True where something that is not `owner`'s stands in front of p, or beside the ray to it.
  bool Hides(const Eigen::Vector2d& p, int owner) const;
  /// True where rays went through p, or passed beside it, no higher than z: what is there and as
  /// high would have been seen. Before the first sweep everywhere.
  bool Sees(const Eigen::Vector2d& p, double z) const;
  const Eigen::Vector2d& origin() const { return origin_; }

 private:
  static constexpr int kBins = 1024;
  static constexpr int kBands = 128;  ///< of ranges, the last one open: beyond it nothing is seen
  static constexpr double kBand = 0.25;  ///< m
  struct Bin {
    float first, second;  ///< m, of the nearest return and of the nearest of another owner
    float farthest;       ///< m, of all returns, the ground's and those out of range too
    int owner;            ///< of the first
  };
  /// Whether `check` holds for a bin, of this index, in the direction d or so near to it that it
  /// matters.
  template <class Check>
  bool Any(const Eigen::Vector2d& d, Check check) const;

  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  double height_ = 0.0;  ///< of the sensor, frame W, m
  std::vector<Bin> bins_;
  std::vector<float> lowest_;  ///< [bin][band]: least slope of the rays that went so far or farther
};

}  // namespace chase::mapping
