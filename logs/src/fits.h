#pragma once

#include <cmath>

#include "logs/src/settled_flight.h"

namespace chase::logs {

constexpr double kAccelBias = 0.05;  // m/s^2: a small MEMS unit's at power-on (ImuConfig)

inline Parameter At(const Solution& s, Eigen::Index i) {
  return {s.value[i], std::sqrt(s.covariance(i, i))};
}

/// Of what is `value` and changes by `slopes` with the coefficients.
inline Parameter Derived(const Solution& s, double value, const Eigen::VectorXd& slopes) {
  return {value, std::sqrt(slopes.dot(s.covariance * slopes))};
}

inline Parameter WithSystematic(const Parameter& p, double sigma) {
  return {p.value, std::hypot(p.sigma, sigma), std::hypot(p.systematic, sigma)};
}

/// Lag and delay in one, which data tell better than each alone. They stand last.
inline Parameter LagAndDelay(const Solution& s) {
  return {s.value.tail<2>().sum(), std::sqrt(s.covariance.bottomRightCorner<2, 2>().sum())};
}

// Each leaves what the flight does not show as it is.

/// What the accelerometer feels across the thrust, which is no thrust, against the velocity
/// (Leishman et al. 2014, IEEE Control Systems 34); wind and what is left of the accelerometer's
/// bias are constants of it. Returns the wind, as far as there is enough drag to show it, m/s.
Eigen::Vector3d FindDrag(const SettledFlight& flight, Identification* result);

/// What the accelerometer feels along the thrust, against the thrust that is asked for and the
/// velocity through the air.
void FindThrust(const SettledFlight& flight, const Eigen::Vector3d& wind, Identification* result);

/// The gyroscope against the error of attitude and the rates fed forward, by PX4's law: the error
/// gives a rate, and what is fed forward comes on top.
void FindAttitude(const SettledFlight& flight, Identification* result);

}  // namespace chase::logs
