#include "logs/src/metrics.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "chase/plan_t.hpp"
#include "logs/src/estimate_errors.h"
#include "logs/src/fault_figures.h"
#include "logs/src/flown_plans.h"
#include "logs/src/landing_figures.h"
#include "logs/src/last_resorts.h"

namespace chase::logs {
namespace {

constexpr double kEndTolerance = 0.1;  // s of the mission that may be missing at either end

using Figure = Metrics::Figure;

std::vector<TruthSample> MissionTruth(const FlightRecord& record) {
  std::vector<TruthSample> out;
  std::copy_if(record.truth.begin(), record.truth.end(), std::back_inserter(out),
               [&](const TruthSample& s) { return record.InMission(s.t); });
  return out;
}

template <class Items, class F>
Figure Mean(const Items& items, F value) {
  if (items.empty()) return std::nullopt;
  double sum = 0.0;
  for (const auto& item : items) sum += value(item);
  return sum / static_cast<double>(items.size());
}

double WrappedAngle(double a) { return std::remainder(a, 2.0 * M_PI); }

/// Figures over consecutive pairs of samples (time step dt > 0).
template <class F>
Figure MeanOverSteps(const std::vector<TruthSample>& truth, F value) {
  double sum = 0.0;
  long count = 0;
  for (size_t i = 1; i < truth.size(); ++i) {
    const double dt = truth[i].t - truth[i - 1].t;
    if (dt <= 0.0) continue;
    sum += value(truth[i - 1], truth[i], dt);
    ++count;
  }
  return count > 0 ? Figure(sum / static_cast<double>(count)) : std::nullopt;
}

void AddRatios(const FlightRecord& record, const std::vector<SampleScore>& scores, Metrics* m) {
  const double desired = record.scenario.chaser.desired_distance;
  m->safe_ratio = Mean(scores, [](const SampleScore& s) { return s.Safe() ? 1.0 : 0.0; });
  m->visible_ratio = Mean(scores, [](const SampleScore& s) { return s.visible ? 1.0 : 0.0; });
  for (const SampleScore& s : scores)
    if (!s.done)
      m->min_clearance_m = std::min(m->min_clearance_m.value_or(s.clearance), s.clearance);
  if (desired <= 0.0) return;
  m->distance_ratio = Mean(scores, [&](const SampleScore& s) { return s.distance / desired; });
  m->distance_error =
      Mean(scores, [&](const SampleScore& s) { return std::abs(s.distance / desired - 1.0); });
}

void AddMotion(const std::vector<TruthSample>& truth, Metrics* m) {
  m->in_image_ratio =
      Mean(truth, [](const TruthSample& s) { return s.target_in_image ? 1.0 : 0.0; });
  m->acceleration_cost = Mean(truth, [](const TruthSample& s) { return s.a.squaredNorm(); });
  m->jerk_cost = MeanOverSteps(truth, [](const TruthSample& a, const TruthSample& b, double dt) {
    return ((b.a - a.a) / dt).squaredNorm();
  });
  const Figure yaw_rate =
      MeanOverSteps(truth, [](const TruthSample& a, const TruthSample& b, double dt) {
        return std::pow(WrappedAngle(b.yaw - a.yaw) / dt, 2);
      });
  if (yaw_rate) m->yaw_rate_rms = std::sqrt(*yaw_rate);
  double chaser = 0.0, target = 0.0;
  for (size_t i = 1; i < truth.size(); ++i) {
    chaser += (truth[i].p - truth[i - 1].p).norm();
    target += (truth[i].target - truth[i - 1].target).norm();
  }
  if (target > 0.0) m->travel_ratio = chaser / target;
}

std::optional<TimeFigures> Stage(const FlightRecord& record, const std::string& process,
                                 const std::string& stage) {
  for (const StageFigures& s : record.stages)
    if (s.process == process && s.stage == stage)
      return TimeFigures{s.mean_ms, s.p50_ms, s.p99_ms, s.max_ms};
  return std::nullopt;
}

void AddPlans(const FlightRecord& record, Metrics* m) {
  for (const PlanSample& plan : record.plans) {
    if (!record.InMission(plan.t)) continue;
    ++m->replans;
    m->fallbacks += plan.verdict > plan_t::WIDER;
  }
  m->plan_ms = Stage(record, "planning", "plan");
  m->predict_ms = Stage(record, "prediction", "predict");
}

void AddSweepLatency(const FlightRecord& record, Metrics* m) {
  std::vector<double> ms;
  for (const auto& [t, latency] : record.sweep_to_setpoint_ms)
    if (record.InMission(t)) ms.push_back(latency);
  if (ms.empty()) return;
  std::sort(ms.begin(), ms.end());
  const auto at = [&](double share) {
    return ms[static_cast<size_t>(share * static_cast<double>(ms.size() - 1))];
  };
  m->sweep_to_setpoint_ms = {*Mean(ms, [](double v) { return v; }), at(0.5), at(0.99), ms.back()};
}

/// By how much each process has come to exceed what it occupied when it was a minute old.
void AddMemoryGrowth(const FlightRecord& record, Metrics* m) {
  constexpr double kSettled = 60.0;  // s
  for (const auto& [process, samples] : record.memory) {
    Figure settled;
    double uptime = 0.0;
    for (const MemorySample& s : samples) {
      if (s.uptime < uptime) settled.reset();
      uptime = s.uptime;
      if (uptime < kSettled) continue;
      if (!settled) settled = s.resident_mb;
      double& growth = m->memory_growth.emplace(process, 0.0).first->second;
      growth = std::max(growth, s.resident_mb / *settled - 1.0);
    }
  }
}

void AddEstimates(const FlightRecord& record, Metrics* m) {
  const auto ate = OdometryError(record);
  m->odometry_ate_m = ate.raw;
  m->odometry_ate_aligned_m = ate.aligned;
  m->target_rmse_m = TargetRmse(record);
  for (const double horizon : {0.5, 1.0, 1.5, 2.0, 2.5}) {
    if (const Figure e = PredictionError(record, horizon))
      m->prediction_error_by_horizon_m[horizon] = *e;
    if (const Figure e = ConstantVelocityError(record, horizon))
      m->prediction_error_constant_velocity_by_horizon_m[horizon] = *e;
  }
  m->prediction_error_m = PredictionError(record, 1.0);
}

void AddCollision(const FlightRecord& record, const std::vector<SampleScore>& scores, Metrics* m) {
  const auto struck = std::find_if(scores.begin(), scores.end(), [](const SampleScore& s) {
    return s.done && s.clearance <= 0.0;
  });
  if (struck != scores.end()) m->struck_after_done_s = struck->t;
  const auto contact =
      std::find_if(scores.begin(), scores.end(), [](const SampleScore& s) { return !s.Safe(); });
  if (contact == scores.end()) return;
  m->collision_s = contact->t;
  const auto sample = std::find_if(record.truth.begin(), record.truth.end(),
                                   [&](const TruthSample& s) { return s.t == contact->t; });
  if (sample != record.truth.end()) m->collided_with = Scorer(record.scenario).Nearest(*sample);
}

bool AtLeast(const Figure& figure, double limit) { return figure && *figure >= limit; }
bool AtMost(const Figure& figure, double limit) { return figure && *figure <= limit; }

void AddLosses(const LogInfo& log, Metrics* m) {
  for (const ChannelInfo& c : log.channels) {
    m->lost_messages[c.channel] = c.missing;
    m->longest_gap_s[c.channel] = 1e-6 * static_cast<double>(c.longest_gap);
    m->gap_begins_s[c.channel] = 1e-6 * static_cast<double>(c.gap_begins);
  }
  m->software = log.SoftwareByKind();
  m->losses = log.Losses();
  m->log_whole = log.Whole();
  m->restarts = log.restarts;
}

/// Of any process, more often than by faults that kill it, or freeze it until its watchdog does.
bool RestartsAtMost(int most, const Metrics& m) {
  return std::all_of(m.restarts.begin(), m.restarts.end(), [&](const auto& process) {
    const auto meant = [&](const FaultFigures& fault) {
      return fault.name == "kill-" + process.first || fault.name == "freeze-" + process.first;
    };
    return process.second - std::count_if(m.faults.begin(), m.faults.end(), meant) <= most;
  });
}

void AddCriteria(const FlightRecord& record, Metrics* m) {
  const world::Scenario& scenario = record.scenario;
  const world::CriteriaSpec& c = scenario.criteria;
  m->criteria["finite_setpoints"] = m->nonfinite_setpoints == 0;
  m->criteria["recorded"] = record.log.Recorded();
  m->criteria["complete"] =
      m->HoldsBeginning() && m->flown_s >= scenario.duration_s - kEndTolerance;
  if (c.safe_ratio >= 0.0) m->criteria["safe_ratio"] = AtLeast(m->safe_ratio, c.safe_ratio);
  if (c.visible_ratio >= 0.0)
    m->criteria["visible_ratio"] = AtLeast(m->visible_ratio, c.visible_ratio);
  if (c.in_image_ratio >= 0.0)
    m->criteria["in_image_ratio"] = AtLeast(m->in_image_ratio, c.in_image_ratio);
  if (c.distance_ratio_max >= 0.0)
    m->criteria["distance_ratio_max"] = AtMost(m->distance_ratio, c.distance_ratio_max);
  if (c.real_time_factor >= 0.0 && m->real_time_factor)
    m->criteria["real_time_factor"] = AtLeast(m->real_time_factor, c.real_time_factor);
  if (c.sweep_to_setpoint >= 0.0 && m->sweep_to_setpoint_ms)
    m->criteria["sweep_to_setpoint"] = m->sweep_to_setpoint_ms->p99 <= 1e3 * c.sweep_to_setpoint;
  if (c.memory_growth >= 0.0 && !m->memory_growth.empty())
    m->criteria["memory_growth"] =
        std::all_of(m->memory_growth.begin(), m->memory_growth.end(),
                    [&](const auto& process) { return process.second <= c.memory_growth; });
  if (c.restarts >= 0) m->criteria["restarts"] = RestartsAtMost(c.restarts, *m);
  if (!c.flight_states.empty())
    m->criteria["flight_states"] = InOrder(c.flight_states, m->flight_states);
  if (c.touchdown_speed >= 0.0)
    m->criteria["touchdown_speed"] = AtMost(m->touchdown_speed_mps, c.touchdown_speed);
  if (c.motors_off >= 0.0) m->criteria["motors_off"] = AtMost(m->motors_off_s, c.motors_off);
}

}  // namespace

bool Metrics::HoldsBeginning() const { return begins_s <= kEndTolerance; }

bool Metrics::Passed() const {
  return !criteria.empty() &&
         std::all_of(criteria.begin(), criteria.end(), [](const auto& c) { return c.second; });
}

Metrics Compute(const FlightRecord& record) { return Compute(record, Score(record)); }

Metrics Compute(const FlightRecord& record, const std::vector<SampleScore>& scores) {
  Metrics m;
  m.begins_s = scores.empty() ? 0.0 : scores.front().t;
  m.flown_s = scores.empty() ? 0.0 : scores.back().t;
  m.cpu_s = record.cpu_s;
  m.real_time_factor = record.real_time_factor;
  m.nonfinite_setpoints = record.nonfinite_setpoints;
  AddFaults(record, &m);
  AddCollision(record, scores, &m);
  AddRatios(record, scores, &m);
  AddMotion(MissionTruth(record), &m);
  AddPlans(record, &m);
  AddSweepLatency(record, &m);
  AddMemoryGrowth(record, &m);
  AddCertificates(record, scores, &m);
  AddEstimates(record, &m);
  AddLosses(record.log, &m);
  AddLanding(record, &m);
  AddLastResorts(record, &m);
  AddCriteria(record, &m);
  return m;
}

}  // namespace chase::logs
