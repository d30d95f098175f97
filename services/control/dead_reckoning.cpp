#include "services/control/dead_reckoning.h"

#include <algorithm>
#include <cmath>

namespace chase::control {

namespace {

constexpr double kAttitudeLag = 0.2;  // s: 1/6.5 of the attitude loop, 0.05 of the rate loop
constexpr double kStep = 0.01;        // s
constexpr double kLongest = 0.5;      // s; a clock that is set forward is no motion

}  // namespace

const Estimate& DeadReckoning::At(double t) {
  const double span = std::clamp(t - t_, 0.0, kLongest);
  const int steps = static_cast<int>(std::ceil(span / kStep));
  const double dt = span / std::max(1, steps);
  for (int i = 0; i < steps; ++i) {
    estimate_.R_WB = estimate_.R_WB.slerp(1.0 - std::exp(-dt / kAttitudeLag), asked_.R_WB);
    const Eigen::Vector3d thrust = estimate_.R_WB * (thrust_ * Eigen::Vector3d::UnitZ());
    estimate_.v_WB += dt * (thrust - kGravity * Eigen::Vector3d::UnitZ() - trim_ -
                            drag_.cwiseProduct(estimate_.v_WB));
  }
  t_ = std::max(t, t_);
  return estimate_;
}

void DeadReckoning::Turn(double yaw) {
  const Eigen::Quaterniond turn = math::FromYaw(yaw);
  estimate_.v_WB = turn * estimate_.v_WB;
  trim_ = turn * trim_;
  estimate_.R_WB = (turn * estimate_.R_WB).normalized();
  asked_.R_WB = (turn * asked_.R_WB).normalized();
}

}  // namespace chase::control
