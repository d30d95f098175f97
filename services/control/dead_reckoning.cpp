#include "services/control/dead_reckoning.h"

#include <algorithm>
#include <cmath>

#include "common/world/ages.h"

namespace chase::control {

namespace {

constexpr double kAttitudeLag = 0.2;  // s: 1/6.5 of the attitude loop, 0.05 of the rate loop
constexpr double kStep = 0.01;        // s
constexpr double kLongest = 0.5;      // s; a clock that is set forward is no motion

}  // namespace

void DeadReckoning::Begin(double t, const Estimate& estimate) {
  t_ = t, estimate_ = estimate;
  while (asked_.size() > 1 && asked_[1].t <= t) asked_.pop_front();
}

void DeadReckoning::Ask(double t, const Setpoint& asked, double gain, const Eigen::Vector3d& trim) {
  while (!asked_.empty() && asked_.back().t >= t) asked_.pop_back();
  asked_.push_back({t, asked, gain * asked.thrust, trim});
  while (asked_[0].t < t - world::kMostAge.velocity) asked_.pop_front();
}

const Estimate& DeadReckoning::At(double t) {
  if (!asked_.empty()) {
    const double until = std::min(t, std::max(t_, asked_.back().t) + kLongest);
    for (size_t i = 0; i < asked_.size(); ++i)
      Follow(asked_[i], i + 1 < asked_.size() ? std::min(until, asked_[i + 1].t) : until);
  }
  t_ = std::max(t, t_);
  return estimate_;
}

void DeadReckoning::Follow(const Asked& asked, double until) {
  if (until <= t_) return;
  const int steps = static_cast<int>(std::ceil((until - t_) / kStep));
  const double dt = (until - t_) / steps;
  for (int i = 0; i < steps; ++i) {
    estimate_.R_WB = estimate_.R_WB.slerp(1.0 - std::exp(-dt / kAttitudeLag), asked.setpoint.R_WB);
    const Eigen::Vector3d thrust = estimate_.R_WB * (asked.thrust * Eigen::Vector3d::UnitZ());
    estimate_.v_WB += dt * (thrust - kGravity * Eigen::Vector3d::UnitZ() - asked.trim -
                            drag_.cwiseProduct(estimate_.v_WB));
  }
  t_ = until;
}

void DeadReckoning::Shift(double by) {
  t_ += by;
  for (Asked& asked : asked_) asked.t += by;
}

void DeadReckoning::Turn(double yaw) {
  const Eigen::Quaterniond turn = math::FromYaw(yaw);
  estimate_.v_WB = turn * estimate_.v_WB;
  estimate_.R_WB = (turn * estimate_.R_WB).normalized();
  for (Asked& asked : asked_) {
    asked.trim = turn * asked.trim;
    asked.setpoint.R_WB = (turn * asked.setpoint.R_WB).normalized();
  }
}

}  // namespace chase::control
