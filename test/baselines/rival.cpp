#include "test/baselines/rival.h"

#include <algorithm>
#include <cmath>

#include "services/planning/stopping.h"

namespace chase::baselines {
namespace {

using Eigen::Vector3d;

constexpr double kExamined = 0.05;  // s between samples
constexpr double kTolerance = 1e-3;

bool KeepsLimits(const planning::PlannerConfig& c, const world::State& s, std::string* reason) {
  const double more = 1.0 + kTolerance;
  if (c.max_speed > 0.0 && s.v.cwiseAbs().maxCoeff() > c.max_speed * more)
    return *reason = "faster than the limit", false;
  if (c.max_acceleration > 0.0 && s.a.cwiseAbs().maxCoeff() > c.max_acceleration * more)
    return *reason = "steeper than the limit", false;
  if (c.z_max > c.z_min && (s.p.z() < c.z_min - kTolerance || s.p.z() > c.z_max + kTolerance))
    return *reason = "outside the heights", false;
  return true;
}

template <class Visit>
void AtSamples(const Pieces& plan, double from, Visit visit) {
  const double span = EndOf(plan) - from;
  const int n = std::max(1, static_cast<int>(std::ceil(span / kExamined)));
  for (int i = 0; i <= n; ++i) visit(from + span * i / n);
}

}  // namespace

std::vector<Body> NearBodies(const planning::PlannerConfig& config,
                             const planning::PlanRequest& request, double reach) {
  constexpr int kPoints = 11;
  std::vector<Vector3d> target;
  for (int i = 0; i < kPoints; ++i)
    target.push_back(request.target.Position(request.t0 + request.horizon * i / (kPoints - 1.0)));
  std::vector<Body> bodies;
  for (const world::Obstacle& o : request.obstacles) {
    const Vector3d c = o.center.Position(request.t0);
    const double radius = 1.0 / std::sqrt(o.shape(0, 0));
    const bool near = std::any_of(target.begin(), target.end(), [&](const Vector3d& q) {
      return (q - c).head<2>().norm() - radius < reach;
    });
    if (near) bodies.push_back({c, world::Inflated(o.shape, config.drone_radius), radius});
  }
  return bodies;
}

double SafetyDistance(const Body& body, const Vector3d& p, Vector3d* gradient) {
  const Vector3d Rx = body.R * (p - body.center);
  if (gradient) *gradient = 2.0 * Rx;
  return Rx.dot(p - body.center);
}

double SightDistance(const Body& body, const Vector3d& p, const Vector3d& q, Vector3d* gradient) {
  const Vector3d u = q - p, Ru = body.R * u;
  const double uu = u.dot(Ru);
  const double s = uu > 0.0 ? std::clamp((body.center - p).dot(Ru) / uu, 0.0, 1.0) : 0.0;
  const Vector3d x = p + s * u - body.center, Rx = body.R * x;
  if (gradient) *gradient = 2.0 * (1.0 - s) * Rx;
  return x.dot(Rx);
}

planning::Verdict Examine(const planning::PlannerConfig& config,
                          const planning::PlanRequest& request, const Pieces& plan,
                          std::string* reason) {
  const auto bodies = NearBodies(config, request);
  std::string unsafe, hidden;
  AtSamples(plan, request.t0, [&](double t) {
    const world::State s = StateAt(plan, t);
    if (!unsafe.empty() || !KeepsLimits(config, s, &unsafe)) return;
    const Vector3d q = request.target.Position(t);
    for (const Body& b : bodies) {
      if (unsafe.empty() && SafetyDistance(b, s.p, nullptr) <= 1.0) unsafe = "touches an obstacle";
      if (hidden.empty() && SightDistance(b, s.p, q, nullptr) <= 1.0) hidden = "loses sight";
    }
  });
  *reason = unsafe.empty() ? hidden : unsafe;
  if (!unsafe.empty()) return planning::Verdict::kBrake;
  return hidden.empty() ? planning::Verdict::kChase : planning::Verdict::kSafeOnly;
}

double Violation(const planning::PlannerConfig& config, const planning::PlanRequest& request,
                 const Pieces& plan, bool sight) {
  const auto bodies = NearBodies(config, request);
  double worst = 0.0;
  AtSamples(plan, request.t0, [&](double t) {
    const Vector3d p = StateAt(plan, t).p, q = request.target.Position(t);
    for (const Body& b : bodies)
      worst = std::max(
          worst, 1.0 - (sight ? SightDistance(b, p, q, nullptr) : SafetyDistance(b, p, nullptr)));
  });
  return worst;
}

planning::PlanResult KeepOrBrake(const planning::PlannerConfig& config,
                                 const planning::PlanRequest& request, const std::string& why) {
  constexpr double kLeast = 0.3;  // s of a plan worth keeping
  planning::PlanResult result;
  const Pieces rest = RestOf(RunningOf(request), request.t0, kLeast);
  if (!rest.empty()) {
    SetPieces(rest, &result);
    std::string fault;
    result.verdict = Examine(config, request, rest, &fault);
    if (result.verdict == planning::Verdict::kChase) result.verdict = planning::Verdict::kKept;
    result.reason = why + "; flies on" + (fault.empty() ? "" : " although it " + fault);
    return result;
  }
  result = planning::RestPlan(config, request);
  result.verdict = planning::Verdict::kBrake;
  result.reason = why + "; brakes";
  return result;
}

planning::PlanResult Answer(const planning::PlannerConfig& config,
                            const planning::PlanRequest& request, const Pieces& plan) {
  planning::PlanResult result;
  SetPieces(plan, &result);
  result.verdict = Examine(config, request, plan, &result.reason);
  return result;
}

bool Rival::IsCertified(const planning::PlanRequest& request, const world::Trajectory& plan) {
  const Pieces rest = RestOf({plan}, request.t0, 0.05);
  std::string reason;
  return !rest.empty() && Examine(config_, request, rest, &reason) == planning::Verdict::kChase;
}

bool IsSound(const planning::PlanRequest& request) {
  const world::State& s = request.start;
  return s.p.allFinite() && s.v.allFinite() && s.a.allFinite() && s.j.allFinite() &&
         request.target.coefficients.allFinite() && request.target.duration > 0.0 &&
         request.horizon > 0.0 && std::isfinite(request.horizon) && std::isfinite(request.t0);
}

}  // namespace chase::baselines
