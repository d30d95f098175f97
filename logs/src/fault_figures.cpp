#include "logs/src/fault_figures.h"

#include <algorithm>
#include <limits>

#include "chase/flight_state_t.hpp"
#include "chase/plan_t.hpp"
#include "chase/tracking_t.hpp"
#include "common/world/ages.h"
#include "logs/src/flown_plans.h"

namespace chase::logs {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kLegs = 0.02;   // m that a body at rest still moves
constexpr double kAtRest = 1.0;  // s that it has not moved by more

/// Something that holds or does not, from time to time.
class Steps {
 public:
  void Add(double t, bool holds) { steps_.emplace_back(t, holds); }
  /// From t on; kNever where it does not come to it.
  double FirstFrom(double t) const {
    auto next = std::upper_bound(steps_.begin(), steps_.end(), t,
                                 [](double at, const auto& step) { return at < step.first; });
    if (next != steps_.begin() && std::prev(next)->second) return t;
    next = std::find_if(next, steps_.end(), [](const auto& step) { return step.second; });
    return next == steps_.end() ? kNever : next->first;
  }

 private:
  std::vector<std::pair<double, bool>> steps_;
};

/// The outputs that differ in kind.
struct Outputs {
  explicit Outputs(const FlightRecord& record) {
    for (const PlanSample& p : record.plans) {
      brakes.Add(p.heard, p.verdict == plan_t::BRAKE || p.verdict == plan_t::WAIT ||
                              p.verdict == plan_t::MITIGATE);
      leaves_sight.Add(p.heard, p.verdict > plan_t::KEPT);
    }
    for (const TrackingSample& s : record.tracking) stops.Add(s.t, s.following != tracking_t::PLAN);
    for (const StateSample& s : record.states) leaves.Add(s.t, s.state != flight_state_t::CHASE);
    for (const AutopilotSample& s : record.autopilot) lands.Add(s.t, s.lands);
  }
  Steps brakes, leaves_sight, stops, leaves, lands;
};

/// A time in which an input is too old.
struct Overdue {
  double heard;  ///< the message that got too old
  double from, until;
};

/// `limits`: when each message was heard, and when it is too old.
std::vector<Overdue> Overdues(const std::vector<std::pair<double, double>>& limits, double end) {
  std::vector<Overdue> all;
  for (size_t i = 0; i < limits.size(); ++i) {
    const auto [heard, limit] = limits[i];
    const double from = std::max(heard, limit);
    const double until = i + 1 < limits.size() ? limits[i + 1].first : end;
    if (from >= until) continue;
    if (!all.empty() && all.back().until >= from)
      all.back().until = until;
    else
      all.push_back({heard, from, until});
  }
  return all;
}

std::vector<Overdue> OverduesOf(const FlightRecord& record, const std::string& input, double limit,
                                double end) {
  std::vector<std::pair<double, double>> limits;
  const auto samples = record.heard.find(input);
  if (samples != record.heard.end())
    for (const HeardSample& s : samples->second) limits.emplace_back(s.t, s.stamp + limit);
  return Overdues(limits, end);
}

std::vector<Overdue> OverduePlans(const FlightRecord& record, double end) {
  std::vector<std::pair<double, double>> limits;
  for (const PlanSample& p : record.plans)
    limits.emplace_back(p.heard, p.stop ? p.stop->start : p.position.end());
  return Overdues(limits, end);
}

/// An input, when it was too old, and what its user shows then.
struct WatchedInput {
  std::string input;
  std::vector<Overdue> overdue;
  std::vector<const Steps*> reactions;
};

std::vector<WatchedInput> WatchedInputs(const FlightRecord& record, const Outputs& out) {
  const double end = record.truth.back().t;
  const world::MostAge& age = world::kMostAge;
  std::vector<WatchedInput> watches = {
      {"OBSTACLES", OverduesOf(record, "OBSTACLES", age.obstacles, end), {&out.brakes, &out.stops}},
      {"UNSEEN", OverduesOf(record, "UNSEEN", age.obstacles, end), {&out.brakes, &out.stops}},
      {"POSE", OverduesOf(record, "POSE", age.pose, end), {&out.stops}},
      {"PREDICTION",
       OverduesOf(record, "PREDICTION", age.prediction, end),
       {&out.leaves_sight, &out.stops}},
      {"PLAN", OverduePlans(record, end), {&out.stops}},
      {"ATTITUDE_SETPOINT",
       OverduesOf(record, "ATTITUDE_SETPOINT", age.setpoint, end),
       {&out.lands}}};
  if (record.states.empty()) return watches;  // nobody leads the flight
  watches.push_back({"TARGET", OverduesOf(record, "TARGET", age.target, end), {&out.leaves}});
  watches.push_back({"FLIGHT_STATE",
                     OverduesOf(record, "FLIGHT_STATE", age.flight_state, end),
                     {&out.brakes, &out.stops}});
  return watches;
}

void AddReaction(const std::vector<WatchedInput>& watches, FaultFigures* fault) {
  const double end = fault->end_s.value_or(kNever);
  for (const WatchedInput& watch : watches)
    for (const Overdue& o : watch.overdue) {
      if (o.from < fault->at_s || o.heard > end) continue;
      double until = o.until;
      for (const Steps* steps : watch.reactions) until = std::min(until, steps->FirstFrom(o.from));
      if (fault->reaction_s && *fault->reaction_s >= until - o.from) continue;
      fault->reaction_s = until - o.from;
      fault->input = watch.input;
    }
}

bool FliesOn(const FlightRecord& record, const TrackingSample& tracking) {
  if (tracking.following != tracking_t::PLAN) return false;
  const PlanSample* plan = Followed(record, tracking);
  return plan && plan->verdict <= plan_t::KEPT && plan->certified_clearance >= 0.0;
}

/// When it came to rest on the ground for good: mission says so, or control comes down and it moves
/// no more.
double AtRest(const FlightRecord& record) {
  for (const StateSample& s : record.states)
    if (s.state == flight_state_t::DONE) return s.t;
  if (record.tracking.empty() || record.tracking.back().following != tracking_t::LAND)
    return kNever;
  const TruthSample& last = record.truth.back();
  const auto moved =
      std::find_if(record.truth.rbegin(), record.truth.rend(),
                   [&](const TruthSample& s) { return (s.p - last.p).norm() > kLegs; });
  const double since = moved == record.truth.rend() ? record.truth.front().t : moved->t;
  return last.t - since > kAtRest ? since : kNever;
}

void AddRecovery(const FlightRecord& record, double at_rest, FaultFigures* fault) {
  if (!fault->end_s) return;
  const double end = *fault->end_s;
  double t = at_rest;
  for (const TrackingSample& s : record.tracking)
    if (s.t >= end && s.t < t && FliesOn(record, s)) t = s.t;
  if (t < kNever) fault->recovery_s = std::max(0.0, t - end);
}

}  // namespace

void AddFaults(const FlightRecord& record, Metrics* m) {
  if (record.faults.empty() || record.truth.empty()) return;
  const Outputs outputs(record);
  const std::vector<WatchedInput> watches = WatchedInputs(record, outputs);
  const double at_rest = AtRest(record);
  bool recovered = true;
  m->fault_time_s = record.faults.front().t;
  for (const FaultSample& sample : record.faults) {
    m->fault += (m->fault.empty() ? "" : "+") + sample.name;
    FaultFigures fault{sample.name, sample.t, sample.end, "", {}, {}};
    AddReaction(watches, &fault);
    AddRecovery(record, at_rest, &fault);
    m->reaction_s = std::max(m->reaction_s, fault.reaction_s);
    m->recovery_s = std::max(m->recovery_s, fault.recovery_s);
    recovered = recovered && (fault.recovery_s || !fault.end_s);
    m->faults.push_back(std::move(fault));
  }
  if (!recovered) m->recovery_s.reset();
}

}  // namespace chase::logs
