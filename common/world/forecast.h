#pragma once

#include <Eigen/Core>

#include "common/world/manoeuvre.h"

namespace chase::world {

/// The target's, as long as planning is not configured otherwise.
inline constexpr Manoeuvre kTargetManoeuvre{0.5, 0.5};

/// Covariance of the target's place t s into a forecast that began with these of its place and
/// velocity, m^2 and m^2/s^2: what planning allows for and viewers draw.
inline Eigen::Matrix3d ForecastCovariance(const Eigen::Matrix3d& position,
                                          const Eigen::Matrix3d& velocity, double t,
                                          const Manoeuvre& manoeuvre = kTargetManoeuvre) {
  return position + t * t * velocity + manoeuvre.Variance(t) * Eigen::Matrix3d::Identity();
}

}  // namespace chase::world
