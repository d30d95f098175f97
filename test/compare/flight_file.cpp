#include "test/compare/flight_file.h"

#include <cmath>

namespace chase::compare {
namespace {

using Json = nlohmann::ordered_json;

Json ToJson(const Times& t) {
  return {{"mean", t.mean}, {"p50", t.p50}, {"p95", t.p95}, {"p99", t.p99}, {"max", t.max}};
}

Json Lapses(const Score& score) {
  Json out = Json::array();
  for (const Lapse& l : score.lapses)
    out.push_back({{"what", l.what},
                   {"from", l.from},
                   {"to", l.to},
                   {"obstacle", l.obstacle},
                   {"plan", l.plan}});
  return out;
}

Json Replans(const Rollout& rollout) {
  Json out = Json::array();
  for (const Replan& r : rollout.replans)
    out.push_back({{"t", r.t},
                   {"ms", r.wall_ms},
                   {"cpu_ms", r.cpu_ms},
                   {"verdict", planning::Name(r.verdict)},
                   {"reason", r.reason}});
  return out;
}

double Rounded(double value) { return std::round(1e4 * value) / 1e4; }

/// Every tenth sample: t, chaser x y z, target x y.
Json Track(const Rollout& rollout) {
  Json out = Json::array();
  for (size_t i = 0; i < rollout.samples.size(); i += 10) {
    const Sample& s = rollout.samples[i];
    out.push_back({Rounded(s.t), Rounded(s.chaser.p.x()), Rounded(s.chaser.p.y()),
                   Rounded(s.chaser.p.z()), Rounded(s.target.x()), Rounded(s.target.y())});
  }
  return out;
}

/// Key of the flight's planner and, after a colon, its parameter set.
void AddPlanner(const std::string& planner, Json* j) {
  const size_t colon = planner.find(':');
  (*j)["planner"] = planner.substr(0, colon);
  if (colon != std::string::npos) (*j)["parameter_set"] = std::stoi(planner.substr(colon + 1));
}

Json Metrics(const Mission& mission, const std::string& planner, const Score& s) {
  Json j;
  j["scenario"] = mission.name;
  AddPlanner(planner, &j);
  j["seed"] = mission.seed;
  j["duration_s"] = mission.duration;
  j["passed"] = s.safe_ratio >= 1.0 && s.visible_ratio >= 1.0;
  j["safe_ratio"] = s.safe_ratio;
  j["min_clearance_m"] = s.min_clearance_m;
  j["proved_safe"] = s.proved_safe;
  j["visible_ratio"] = s.visible_ratio;
  j["visible_ratio_physical"] = s.visible_ratio_physical;
  j["min_sight_clearance_m"] = s.min_sight_clearance_m;
  j["in_image_ratio"] = nullptr;  // yaw is not flown
  j["distance_ratio"] = s.distance_ratio;
  j["distance_error"] = s.distance_error;
  j["travel_ratio"] = s.travel_ratio;
  j["acceleration_cost"] = s.acceleration_cost;
  j["jerk_cost"] = s.jerk_cost;
  j["yaw_rate_rms"] = s.yaw_rate_rms;
  j["peak_speed"] = s.peak_speed;
  j["peak_acceleration"] = s.peak_acceleration;
  j["min_height_m"] = s.min_height;
  j["max_height_m"] = s.max_height;
  j["plan_ms"] = ToJson(s.plan_ms);
  j["plan_cpu_ms"] = ToJson(s.plan_cpu_ms);
  j["predict_ms"] = nullptr;
  j["replans"] = s.replans;
  j["fallbacks"] = s.fallbacks;
  j["verdicts"] = s.verdicts;
  j["lapses"] = Lapses(s);
  return j;
}

}  // namespace

nlohmann::ordered_json FlightJson(const Mission& mission, const std::string& planner,
                                  const Rollout& rollout, const Score& score) {
  Json j;
  j["metrics"] = Metrics(mission, planner, score);
  j["desired_distance"] = mission.desired_distance;
  j["drone_radius"] = mission.drone_radius;
  Json circles = Json::array();
  for (const auto& o : mission.obstacles)
    circles.push_back({Rounded(o.center.coefficients(0, 0)), Rounded(o.center.coefficients(0, 1)),
                       Rounded(1.0 / std::sqrt(o.shape(0, 0)))});
  j["obstacles"] = circles;
  j["track"] = Track(rollout);
  j["replans"] = Replans(rollout);
  return j;
}

}  // namespace chase::compare
