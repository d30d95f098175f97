#pragma once

#include <vector>

#include "services/perception/place/target_fit.h"

namespace chase::perception {

// LiDAR points against a predicted target.

inline constexpr double kLidarGate = 0.35;  ///< m from the surface: further off is something else
/// LiDAR points that are no chance: what they hit is one thing.
inline constexpr int kSurelyHit = 10;

/// Standard deviation of the target's position along the line of sight [m].
double RangeSigma(const TargetGaussian& target, const Camera& camera);

/// The points of a cluster that lie within `gate` m of the predicted surface, thinned; none when
/// they are too few to give a range.
std::vector<TargetPoint> PointsOnTarget(const FitInput& input,
                                        const std::vector<TargetPoint>& cluster, double gate);

/// Rays to the points on the detection that go through a target placed there, and end behind it.
int RaysThrough(const FitInput& input, const TargetGaussian& target);

/// From the camera [m]; the cluster must hold enough points to give a range.
double MedianRange(const std::vector<TargetPoint>& cluster);
bool GivesRange(const std::vector<TargetPoint>& cluster);

}  // namespace chase::perception
