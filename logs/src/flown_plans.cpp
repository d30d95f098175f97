#include "logs/src/flown_plans.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "chase/tracking_t.hpp"
#include "logs/src/estimate_errors.h"
#include "logs/src/landing_figures.h"

namespace chase::logs {
namespace {

/// Where the plan wants the body at t: on its stop once that has begun.
Eigen::Vector3d Wanted(const PlanSample& plan, double t) {
  const bool stops = plan.stop && t > plan.stop->start;
  const world::Trajectory& way = stops ? *plan.stop : plan.position;
  return way.Position(std::min(t, way.end()));
}

/// From the true frame W to the one in which the plan was heard. What the plan keeps off had been
/// listed in that one, and was off alike: that it drifted before, or is turned, is no error of
/// tracking.
Eigen::Isometry3d FrameOf(const FlightRecord& record, const PlanSample& plan) {
  const auto next = std::upper_bound(record.poses.begin(), record.poses.end(), plan.heard,
                                     [](double t, const PoseSample& pose) { return t < pose.t; });
  if (next == record.poses.begin()) return Eigen::Isometry3d::Identity();
  const PoseSample& pose = *std::prev(next);
  const auto truth = TruthAt(record.truth, pose.t);
  if (!truth) return Eigen::Isometry3d::Identity();
  return FrameAt(pose, *truth);
}

}  // namespace

const char* VerdictName(int verdict) {
  constexpr const char* kNames[] = {"chase", "wider", "kept",   "safe_only",
                                    "brake", "wait",  "escape", "mitigate"};
  return kNames[verdict];
}

const PlanSample* Followed(const FlightRecord& record, const TrackingSample& tracking) {
  for (auto plan = record.plans.rbegin(); plan != record.plans.rend(); ++plan)
    if (plan->heard <= tracking.t && plan->seq == tracking.plan_seq) return &*plan;
  return nullptr;
}

FlownPlans::FlownPlans(const FlightRecord& record) {
  const auto names = [](const TrackingSample& s) { return s.plan_seq >= 0; };
  if (std::none_of(record.tracking.begin(), record.tracking.end(), names)) {
    for (const PlanSample& plan : record.plans)
      steps_.push_back({plan.t, ComesDown(record, plan.t) ? nullptr : &plan});
    for (const StateSample& s : record.states)
      if (ComesDown(record, s.t)) steps_.push_back({s.t, nullptr});
    std::stable_sort(steps_.begin(), steps_.end(),
                     [](const Step& a, const Step& b) { return a.t < b.t; });
    return;
  }
  double before = -HUGE_VAL;
  for (const TrackingSample& s : record.tracking) {
    const bool follows = s.following == tracking_t::PLAN || s.following == tracking_t::STOP;
    const PlanSample* plan = follows ? Followed(record, s) : nullptr;
    const bool took_over = plan && !steps_.empty() && steps_.back().plan;
    const double from = took_over ? std::clamp(plan->t, before, s.t) : s.t;
    if (steps_.empty() || steps_.back().plan != plan) steps_.push_back({from, plan});
    before = s.t;
  }
}

void AddCertificates(const FlightRecord& record, const std::vector<SampleScore>& scores,
                     Metrics* m) {
  FlownPlans flown(record), followed(record);
  long kept = 0, asked = 0;
  for (size_t i = 0; i < scores.size(); ++i) {
    const PlanSample* plan = flown.At(scores[i].t);
    if (!plan && ComesDown(record, scores[i].t)) continue;
    ++asked;
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
  const PlanSample* before = nullptr;
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  for (const TruthSample& s : record.truth) {
    const PlanSample* plan = record.InMission(s.t) ? followed.At(s.t) : nullptr;
    if (!plan) continue;
    if (plan != before) frame = FrameOf(record, *plan);
    before = plan;
    errors.push_back((frame * s.p - Wanted(*plan, s.t)).norm());
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
