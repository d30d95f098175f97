#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "services/mapping/sweep.h"

namespace chase::mapping {

/// Where a sweep's lowest rays meet level ground.
struct LowestRays {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< of the scanner, frame W
  double elevation = -M_PI / 12.0;  ///< above the plane across it, rad; VLP-16's, by its manual
  double height = 1.0;              ///< of the sensor above the ground, m
  double range = 20.0;              ///< m, that returns from the ground are sure to come from

  /// In the unit direction d in plan.
  bool MeetGround(const Eigen::Vector2d& d) const;
};

/// The nearest returns of a sweep by their direction from the sensor, the ground's left out: what
/// hides what. Where the ground should have returned a ray and nothing did, something is too near
/// for the sensor; where all rays rise into the sky that tells of nothing. And how low rays passed
/// that went farther: what would have been seen.
class Panorama {
 public:
  /// `owner[i]`: cluster of return i, or -1.
  void Take(const Eigen::Vector3d& origin, const LowestRays& rays,
            const std::vector<Return>& returns, const std::vector<int>& owner);
  /// True where something that is not `owner`'s stands in front of p, or beside the ray to it, by
  /// more than `depth` m.
  bool Hides(const Eigen::Vector3d& p, int owner, double depth = 0.0) const;
  /// True where rays to p, or lower, came into the `depth` m before it and nothing hides those:
  /// what is there, as deep and as high, would have been seen. Before the first sweep everywhere.
  bool Sees(const Eigen::Vector3d& p, double depth) const;
  const Eigen::Vector2d& origin() const { return origin_; }

 private:
  static constexpr int kBins = 1024;
  static constexpr int kBands = 128;  ///< of ranges, the last one open: beyond it nothing is seen
  static constexpr double kBand = 0.25;  ///< m
  static constexpr int kRises = 16;      ///< of slopes, the first and the last one open
  static constexpr double kRise = 0.1;   ///< three rings of a scanner with one every 2 deg
  struct Bin {
    float first, second;  ///< m, of the nearest return and of the nearest of another owner
    int owner;            ///< of the first
  };
  static int Rise(double slope);
  /// Whether `check` holds for a bin, of this index in plan, within `beside` m of the way to d.
  template <class Check>
  static bool Any(const Eigen::Vector2d& d, double beside, Check check);

  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  double height_ = 0.0;    ///< of the sensor, frame W, m
  std::vector<Bin> bins_;  ///< [bin][rise]
  std::vector<float>
      farthest_;               ///< [bin] m, of all returns, the ground's and those out of range too
  std::vector<float> lowest_;  ///< [bin][band]: least slope of the rays that went so far or farther
};

}  // namespace chase::mapping
