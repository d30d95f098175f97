#include "services/control/plan_follower.h"

#include <algorithm>
#include <cmath>

#include "common/world/yaw.h"

namespace chase::control {

namespace {

constexpr std::size_t kMostWaiting = 16;

double YawDerivative(const Plan& plan, int order, double t) {
  const double tau = (t - plan.position.start) / plan.position.duration;
  double sum = 0.0;
  for (Eigen::Index k = plan.yaw.size(); k-- > order;)
    sum = sum * tau + (order == 0 ? 1.0 : static_cast<double>(k)) * plan.yaw[k];
  return order == 0 ? sum : sum / plan.position.duration;
}

/// Where t lies on the trajectory; at rest at its end.
world::State OnWay(const world::Trajectory& way, double t) {
  if (t < way.end()) return way.At(t);
  world::State rest;
  rest.p = way.Position(way.end());
  return rest;
}

bool IsFinite(const world::Trajectory& x) {
  return x.coefficients.allFinite() && std::isfinite(x.start) && std::isfinite(x.duration) &&
         x.duration > 0.0;
}

}  // namespace

Reference Sample(const Plan& plan, double t) {
  Reference r;
  if (plan.stop && t >= plan.stop->start) {
    const world::Trajectory& stop = *plan.stop;
    r.state = OnWay(stop, t);
    const world::Yaw left{YawDerivative(plan, 0, stop.start), YawDerivative(plan, 1, stop.start)};
    const auto [yaw, rate] = world::YawOnStop(left, stop.duration, t - stop.start);
    r.yaw = yaw;
    r.yaw_rate = rate;
    return r;
  }
  const world::Trajectory& way = plan.position;
  r.state = OnWay(way, t);
  r.yaw = YawDerivative(plan, 0, std::min(t, way.end()));
  r.yaw_rate = t < way.end() ? YawDerivative(plan, 1, t) : 0.0;
  return r;
}

double StopsAt(const Plan& plan) { return plan.stop ? plan.stop->start : plan.position.end(); }

bool PlanFollower::Add(const Plan& plan) {
  const world::Trajectory& p = plan.position;
  if (!IsFinite(p) || !plan.yaw.allFinite() || plan.yaw.size() == 0) return false;
  if (plan.stop && !IsFinite(*plan.stop)) return false;
  if (running_ && p.start < running_->position.start) return false;
  const auto later = std::find_if(waiting_.begin(), waiting_.end(), [&](const Plan& other) {
    return other.position.start >= p.start;
  });
  waiting_.erase(later, waiting_.end());
  if (waiting_.size() == kMostWaiting) waiting_.pop_back();
  waiting_.push_back(plan);
  return true;
}

const Plan* PlanFollower::FlownAt(double t) const {
  const Plan* plan = running_ ? &*running_ : nullptr;
  for (const Plan& next : waiting_)
    if (next.position.start <= t) plan = &next;
  return plan;
}

std::optional<Reference> PlanFollower::At(double t) const {
  const Plan* plan = FlownAt(t);
  if (!plan) return std::nullopt;
  return Sample(*plan, t);
}

void PlanFollower::Advance(double t) {
  while (!waiting_.empty() && waiting_.front().position.start <= t) {
    running_ = std::move(waiting_.front());
    waiting_.erase(waiting_.begin());
  }
}

}  // namespace chase::control
