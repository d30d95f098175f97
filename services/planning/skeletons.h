#pragma once

#include <Eigen/Core>
#include <vector>

#include "services/planning/problem.h"

namespace chase::planning {

enum class Layout { kNormal, kWide, kCautious };

/// View skeletons (Jeon 2021, section IV-A): at the times n T / N, points around the target at
/// radii (1 -+ spread) l_des and low elevations. Azimuths lie densest around the drone's present
/// bearing and reach round the whole ring. kWide doubles the choices and spreads radii and
/// elevations.
///
/// With config.adaptive a point that an obstacle covers, or from which the target is hidden, slides
/// to the nearest azimuth and radius that are free, and clutter around the target adds choices.
class SkeletonPlacer {
 public:
  explicit SkeletonPlacer(const PlannerConfig& config) : config_(config) {}

  void Place(Layout layout, Problem* problem);
  /// The plain ring without regard to obstacles, `choices` at each of `steps` times.
  void PlaceRing(int steps, int choices, Problem* problem);

  struct Spread {
    double radius_near, radius_far;  ///< m
    double low, high;                ///< elevations, rad
  };

 private:
  void PlaceAt(int steps, int choices, const Spread& spread, bool slide, Problem* problem);
  const std::vector<Eigen::Vector2d>& TurnsOf(int choices);

  PlannerConfig config_;
  std::vector<std::vector<Eigen::Vector2d>> turns_;  ///< [choices]: from the present bearing
};

}  // namespace chase::planning
