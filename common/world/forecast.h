#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "common/world/manoeuvre.h"
#include "common/world/obstacle.h"

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

/// Walkers change their velocity as if their acceleration were white noise of this spectral density
/// along each level axis, m^2/s^3: over t s it adds a third of it times t^3 to the variance of the
/// place. Bar-Shalom, Li and Kirubarajan 2001, "Estimation with Applications to Tracking and
/// Navigation", section 6.2.2. With it at most 4.5 % of walkers are beyond two deviations 0.5 to
/// 2.5 s ahead (crowds 1011 to 1022, `test/flight/calibration`); the tracker's own has half of it.
inline constexpr double kMoverNoise = 0.4;
/// The velocity's covariance in a list of obstacles holds what that adds for so long, s: no longer
/// than a chase flies a plan, as what is wider there hides the target.
inline constexpr double kNoiseListed = 0.5;

/// What is to be added to the velocity's variance of what moves, along each level axis, so that the
/// variance of its place, which grows with the square of the time, holds for `ahead` s what white
/// noise adds, m^2/s^2.
inline double UnlistedVariance(double ahead) {
  return kMoverNoise / 3.0 * std::max(0.0, ahead - kNoiseListed);
}

}  // namespace chase::world
