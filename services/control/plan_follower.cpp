#include "services/control/plan_follower.h"

#include <algorithm>
#include <cmath>

namespace chase::control {

namespace {

constexpr std::size_t kMostWaiting = 16;
constexpr double kRestingSpeed = 0.02;         // m/s
constexpr double kRestingAcceleration = 0.05;  // m/s^2

/// Place s on a plan's own time axis and its derivatives with respect to t.
struct Pace {
  double s, ds, dds, ddds;
};

// Over u = (t - from) / 2d in [0,1]: s = from + d (2u - 2u^3 + u^4). It leaves at rate 1 and comes
// to rest after 2d, having covered d, with the rate and its derivative continuous.
Pace Slowed(double t, double from, double d) {
  const double u = (t - from) / (2.0 * d);
  if (u >= 1.0) return {from + d, 0.0, 0.0, 0.0};
  return {from + d * (2.0 * u - 2.0 * u * u * u + u * u * u * u),
          1.0 - 3.0 * u * u + 2.0 * u * u * u, 3.0 * (u * u - u) / d,
          1.5 * (2.0 * u - 1.0) / (d * d)};
}

bool EndsAtRest(const world::Trajectory& position) {
  return position.Velocity(position.end()).norm() < kRestingSpeed &&
         position.Acceleration(position.end()).norm() < kRestingAcceleration;
}

Pace PaceAt(const world::Trajectory& position, double t, double slow_down) {
  if (t <= position.start) return {position.start, 1.0, 0.0, 0.0};
  const double d = EndsAtRest(position) ? 0.0 : std::min(slow_down, position.duration);
  if (t < position.end() - d) return {t, 1.0, 0.0, 0.0};
  if (d <= 0.0) return {position.end(), 0.0, 0.0, 0.0};
  return Slowed(t, position.end() - d, d);
}

double YawDerivative(const Plan& plan, int order, double t) {
  const double tau = (t - plan.position.start) / plan.position.duration;
  double sum = 0.0;
  for (int k = static_cast<int>(plan.yaw.size()) - 1; k >= order; --k)
    sum = sum * tau + (order == 0 ? 1.0 : k) * plan.yaw[k];
  return order == 0 ? sum : sum / plan.position.duration;
}

}  // namespace

Reference Sample(const Plan& plan, double t, double slow_down) {
  const Pace pace = PaceAt(plan.position, t, slow_down);
  const world::State on_path = plan.position.At(pace.s);
  Reference r;
  r.state.p = on_path.p;
  r.state.v = on_path.v * pace.ds;
  r.state.a = on_path.a * pace.ds * pace.ds + on_path.v * pace.dds;
  r.state.j = on_path.j * pace.ds * pace.ds * pace.ds + 3.0 * on_path.a * pace.ds * pace.dds +
              on_path.v * pace.ddds;
  r.yaw = YawDerivative(plan, 0, pace.s);
  r.yaw_rate = YawDerivative(plan, 1, pace.s) * pace.ds;
  return r;
}

bool PlanFollower::Add(const Plan& plan) {
  const auto& p = plan.position;
  if (!p.coefficients.allFinite() || !plan.yaw.allFinite() || plan.yaw.size() == 0) return false;
  if (!std::isfinite(p.start) || !std::isfinite(p.duration) || p.duration <= 0.0) return false;
  if (running_ && p.start < running_->position.start) return false;
  const auto later = std::find_if(waiting_.begin(), waiting_.end(), [&](const Plan& other) {
    return other.position.start >= p.start;
  });
  waiting_.erase(later, waiting_.end());
  if (waiting_.size() == kMostWaiting) waiting_.pop_back();
  waiting_.push_back(plan);
  return true;
}

std::optional<Reference> PlanFollower::At(double t) const {
  const Plan* plan = running_ ? &*running_ : nullptr;
  for (const Plan& next : waiting_)
    if (next.position.start <= t) plan = &next;
  if (!plan) return std::nullopt;
  return Sample(*plan, t, slow_down_);
}

void PlanFollower::Advance(double t) {
  while (!waiting_.empty() && waiting_.front().position.start <= t) {
    running_ = std::move(waiting_.front());
    waiting_.erase(waiting_.begin());
  }
}

double PlanFollower::Overdue(double t) const {
  if (!waiting_.empty()) return t - waiting_.back().position.end();
  return running_ ? t - running_->position.end() : 0.0;
}

}  // namespace chase::control
