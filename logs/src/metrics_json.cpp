#include <cmath>
#include <nlohmann/json.hpp>

#include "chase/plan_t.hpp"
#include "logs/src/flown_plans.h"
#include "logs/src/metrics.h"
#include "logs/src/output.h"
#include "logs/src/round_numbers.h"

namespace chase::logs {
namespace {

using Json = nlohmann::ordered_json;

Json Number(const Metrics::Figure& figure) {
  return figure && std::isfinite(*figure) ? Json(*figure) : Json();
}

Json Times(const std::optional<TimeFigures>& t) {
  if (!t) return {};
  return {{"mean", t->mean}, {"p50", t->p50}, {"p99", t->p99}, {"max", t->max}};
}

Json ByHorizon(const std::map<double, double>& errors) {
  Json out = Json::object();
  for (const auto& [horizon, error] : errors) {
    std::string key = std::to_string(horizon);
    out[key.substr(0, key.find('.') + 2)] = error;
  }
  return out;
}

Json Faults(const std::vector<FaultFigures>& faults) {
  Json out = Json::array();
  for (const FaultFigures& f : faults)
    out.push_back({{"name", f.name},
                   {"at_s", f.at_s},
                   {"end_s", Number(f.end_s)},
                   {"input", f.input},
                   {"reaction_s", Number(f.reaction_s)},
                   {"recovery_s", Number(f.recovery_s)}});
  return out;
}

Json Verdicts(const std::map<int, double>& seconds) {
  Json out = Json::object();
  for (int v = 0; v <= plan_t::MITIGATE; ++v) {
    const auto found = seconds.find(v);
    out[VerdictName(v)] = found == seconds.end() ? 0.0 : found->second;
  }
  return out;
}

}  // namespace

std::string MetricsJson(const FlightRecord& record, const Metrics& m) {
  Json j;
  j["scenario"] = record.scenario.name;
  j["seed"] = record.seed;
  if (const std::string utc = record.log.Utc(); !utc.empty()) j["recorded_utc"] = utc;
  j["duration_s"] = record.scenario.duration_s;
  j["fault"] = m.fault;
  j["fault_time_s"] = m.fault_time_s;
  j["faults"] = Faults(m.faults);
  j["reaction_s"] = Number(m.reaction_s);
  j["recovery_s"] = Number(m.recovery_s);
  j["nonfinite_setpoints"] = m.nonfinite_setpoints;
  j["flown_s"] = m.flown_s;
  j["collision_s"] = m.collision_s;
  j["collided_with"] = m.collided_with;
  j["struck_after_done_s"] = m.struck_after_done_s;
  j["passed"] = m.Passed();
  j["safe_ratio"] = Number(m.safe_ratio);
  j["min_clearance_m"] = Number(m.min_clearance_m);
  j["visible_ratio"] = Number(m.visible_ratio);
  j["in_image_ratio"] = Number(m.in_image_ratio);
  j["distance_ratio"] = Number(m.distance_ratio);
  j["distance_error"] = Number(m.distance_error);
  j["travel_ratio"] = Number(m.travel_ratio);
  j["acceleration_cost"] = Number(m.acceleration_cost);
  j["jerk_cost"] = Number(m.jerk_cost);
  j["yaw_rate_rms"] = Number(m.yaw_rate_rms);
  j["plan_ms"] = Times(m.plan_ms);
  j["predict_ms"] = Times(m.predict_ms);
  j["sweep_to_setpoint_ms"] = Times(m.sweep_to_setpoint_ms);
  const bool planned = !record.plans.empty();
  j["replans"] = planned ? Json(m.replans) : Json();
  j["fallbacks"] = planned ? Json(m.fallbacks) : Json();
  j["certified_clearance_m"] = Number(m.certified_clearance_m);
  j["certificate_kept_ratio"] = Number(m.certificate_kept_ratio);
  j["tube_exceeded_ratio"] = Number(m.tube_exceeded_ratio);
  j["tracking_error_p99_m"] = Number(m.tracking_error_p99_m);
  j["verdict_s"] = Verdicts(m.verdict_s);
  j["odometry_ate_m"] = Number(m.odometry_ate_m);
  j["odometry_ate_aligned_m"] = Number(m.odometry_ate_aligned_m);
  j["target_rmse_m"] = Number(m.target_rmse_m);
  j["prediction_error_m"] = Number(m.prediction_error_m);
  j["prediction_error_by_horizon_m"] = ByHorizon(m.prediction_error_by_horizon_m);
  const auto& straight = m.prediction_error_constant_velocity_by_horizon_m;
  j["prediction_error_constant_velocity_by_horizon_m"] =
      straight.empty() ? Json() : ByHorizon(straight);
  j["cpu_s"] = Json(m.cpu_s);
  j["memory_growth"] = Json(m.memory_growth);
  j["restarts"] = Json(m.restarts);
  j["real_time_factor"] = Number(m.real_time_factor);
  j["lost_messages"] = Json(m.lost_messages);
  j["longest_gap_s"] = Json(m.longest_gap_s);
  j["gap_begins_s"] = Json(m.gap_begins_s);
  j["software"] = Json(m.software);
  j["losses"] = Json(m.losses);
  j["log_whole"] = m.log_whole;
  if (!m.flight_states.empty()) {
    for (const StateFigures& s : m.flight_states)
      j["flight_states"].push_back({{"state", s.name}, {"at_s", s.at_s}, {"reason", s.reason}});
    j["touchdown_speed_mps"] = Number(m.touchdown_speed_mps);
    j["motors_off_s"] = Number(m.motors_off_s);
  }
  j["plans_in_air"] = m.plans_in_air;
  j["uncertified_brakes"] = m.uncertified_brakes;
  j["accelerating_brakes"] = m.accelerating_brakes;
  j["criteria"] = Json(m.criteria);
  RoundNumbers(&j);
  return j.dump(2) + "\n";
}

void WriteMetricsJson(const std::string& file, const FlightRecord& record, const Metrics& metrics) {
  WriteFile(file, MetricsJson(record, metrics));
}

}  // namespace chase::logs
