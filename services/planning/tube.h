#pragma once

#include <Eigen/Core>

#include "services/planning/pilot_inputs.h"
#include "services/planning/planning_config.h"

namespace chase::planning {

/// m: with a wider one hardly any door could be passed.
inline constexpr double kWidestTube = 0.3;

/// About a plan: the body strays from it by the tracking error, and the estimate from the body.
struct Tube {
  double radius = 0.0;  ///< m
  double beyond = 0.0;  ///< m by which the body may leave it all the same: the widest is too tight
  /// Covariance of the frame's velocity beyond what the tube has to spare for it, m^2/s^2.
  Eigen::Matrix3d drift = Eigen::Matrix3d::Zero();
};

/// Wide enough for `bound` [m], which control tracks within, and for two deviations of the body's
/// place. What is left of it holds drift of the frame where plans are `chased`, which are limited
/// to the horizon: ways home and down may take 17 s.
Tube MakeTube(const PlanningConfig& config, const BodyEstimate& body, double bound, bool chased);

}  // namespace chase::planning
