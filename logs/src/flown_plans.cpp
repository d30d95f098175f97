#include "logs/src/flown_plans.h"

#include <algorithm>
#include <cmath>

#include "logs/src/landing_figures.h"

namespace chase::logs {
namespace {

/// Where the plan wants the body at t: on its stop once that has begun.
Eigen::Vector3d Wanted(const PlanSample& plan, double t) {
  const bool stops = plan.stop && t > plan.stop->start;
  const world::Trajectory& way = stops ? *plan.stop : plan.position;
  return way.Position(std::min(t, way.end()));
}

}  // namespace

const char* VerdictName(int verdict) {
  constexpr const char* kNames[] = {"chase", "wider", "kept",   "safe_only",
                                    "brake", "wait",  "escape", "mitigate"};
  return kNames[verdict];
}

void AddCertificates(const FlightRecord& record, const std::vector<SampleScore>& scores,
                     Metrics* m) {
  FlownPlans flown(record), followed(record);
  long kept = 0, asked = 0;
  for (size_t i = 0; i < scores.size(); ++i) {
    if (ComesDown(record, scores[i].t)) continue;
    ++asked;
    const PlanSample* plan = flown.At(scores[i].t);
    if (!plan) continue;
    const double step = i + 1 < scores.size() ? scores[i + 1].t - scores[i].t : 0.0;
    m->verdict_s[plan->verdict] += step;
    if (plan->certified_clearance < 0.0) continue;
    m->certified_clearance_m = std::min(
        m->certified_clearance_m.value_or(plan->certified_clearance), plan->certified_clearance);
    kept += scores[i].clearance >= plan->certified_clearance;
  }
  if (asked > 0) m->certificate_kept_ratio = static_cast<double>(kept) / static_cast<double>(asked);
  std::vector<double> errors;
  long exceeded = 0;
  for (const PoseSample& pose : record.poses) {
    if (!record.InMission(pose.t) || ComesDown(record, pose.t)) continue;
    const PlanSample* plan = followed.At(pose.t);
    if (!plan) continue;
    errors.push_back((pose.p - Wanted(*plan, pose.t)).norm());
    exceeded += errors.back() > plan->hard_radius - record.scenario.chaser.radius;
  }
  if (errors.empty()) return;
  m->tube_exceeded_ratio = static_cast<double>(exceeded) / static_cast<double>(errors.size());
  const auto p99 =
      errors.begin() + static_cast<long>(0.99 * static_cast<double>(errors.size() - 1));
  std::nth_element(errors.begin(), p99, errors.end());
  m->tracking_error_p99_m = *p99;
}

}  // namespace chase::logs
