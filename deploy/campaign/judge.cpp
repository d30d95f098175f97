#include "deploy/campaign/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace chase::campaign {
namespace {

using Json = nlohmann::ordered_json;

bool IsNumber(const Json& json, const char* key) {
  const auto at = json.find(key);
  return at != json.end() && at->is_number() && std::isfinite(at->get<double>());
}

double Number(const Json& json, const char* key, double without) {
  return IsNumber(json, key) ? json[key].get<double>() : without;
}

/// What the metrics lack to be judged; empty when nothing.
std::string Malformed(const Json& metrics, int64_t seed) {
  if (!metrics.is_object()) return "no object";
  for (const char* key :
       {"flown_s", "duration_s", "safe_ratio", "min_clearance_m", "visible_ratio"})
    if (!IsNumber(metrics, key)) return fmt::format("no number {}", key);
  if (Number(metrics, "seed", -1.0) != static_cast<double>(seed)) return "another seed";
  const auto criteria = metrics.find("criteria");
  if (criteria == metrics.end() || !criteria->is_object() || criteria->empty())
    return "no criteria";
  for (const Json& passed : *criteria)
    if (!passed.is_boolean()) return "a criterion that is neither true nor false";
  return "";
}

class Judgement {
 public:
  Judgement(const Json& metrics, double duration) : m_(metrics) {
    const double mission = m_["duration_s"];
    asked_ = duration > 0.0 ? std::min(duration, mission) : mission;
    constexpr double kEndTolerance = 0.1;  // s, as metrics.json's own `complete`
    complete_ = m_["flown_s"].get<double>() >= asked_ - kEndTolerance;
    for (const auto& [name, passed] : m_["criteria"].items())
      if (!passed.get<bool>() && name != "complete" && name != "real_time_factor")
        failed_.push_back(name);
  }

  std::string Outcome() const {
    if (Touched()) return outcome::kCollision;
    if (complete_ && failed_.empty()) return outcome::kPassed;
    if (OdometryLost()) return outcome::kOdometryLost;
    return Has("visible_ratio") || Has("in_image_ratio") ? outcome::kTargetLost : outcome::kOther;
  }

  std::string Why() const {
    if (Outcome() == outcome::kPassed) return "";
    std::vector<std::string> reasons;
    if (Touched()) reasons.push_back(Collision());
    if (OdometryLost())
      reasons.push_back(
          fmt::format("odometry lost, {:.2f} m off", m_["odometry_ate_m"].get<double>()));
    for (const std::string& name : failed_) reasons.push_back(Failed(name));
    if (!complete_ && !Touched())
      reasons.push_back(
          fmt::format("ended at {:.1f} s of {:.1f} s", m_["flown_s"].get<double>(), asked_));
    std::string text;
    for (const std::string& reason : reasons)
      if (!reason.empty()) text += (text.empty() ? "" : "; ") + reason;
    return text;
  }

 private:
  bool Has(const std::string& name) const {
    return std::find(failed_.begin(), failed_.end(), name) != failed_.end();
  }
  bool Touched() const {
    return Number(m_, "collision_s", -1.0) >= 0.0 || m_["safe_ratio"].get<double>() < 1.0;
  }
  bool OdometryLost() const { return Number(m_, "odometry_ate_m", 0.0) > kOdometryLost; }

  std::string Collision() const {
    std::string with = "something", at;
    if (m_.contains("collided_with") && m_["collided_with"].is_string() &&
        !m_["collided_with"].get<std::string>().empty())
      with = m_["collided_with"];
    if (Number(m_, "collision_s", -1.0) >= 0.0)
      at = fmt::format(" at {:.2f} s", m_["collision_s"].get<double>());
    return "collision with " + with + at;
  }

  std::string Failed(const std::string& name) const {
    if (name == "safe_ratio") return "";  // the collision says it
    const bool most = name.size() > 4 && name.substr(name.size() - 4) == "_max";
    const std::string key = most ? name.substr(0, name.size() - 4) : name;
    if (!IsNumber(m_, key.c_str())) return name + " failed";
    return fmt::format("{} {:.3f} too {}", key, m_[key].get<double>(), most ? "high" : "low");
  }

  const Json& m_;
  double asked_;
  bool complete_;
  std::vector<std::string> failed_;
};

}  // namespace

Json Judge(const Flight& flight, const Json& result, double duration) {
  const Json metrics = result.value("metrics", Json());
  std::string problem = result.value("ended", std::string());
  if (problem.empty())
    if (const std::string lack = Malformed(metrics, flight.seed); !lack.empty())
      problem = "chase-flight: malformed metrics.json: " + lack;
  Json entry = {{"scenario", flight.scenario}};
  if (!flight.kind.empty()) entry["kind"] = flight.kind;
  entry.update({{"fault", flight.fault}, {"seed", flight.seed}});
  if (problem.empty()) {
    const Judgement judgement(metrics, duration);
    entry["outcome"] = judgement.Outcome();
    entry["why"] = judgement.Why();
  } else {
    entry["outcome"] = outcome::kError;
    entry["why"] = "ended by an error: " + problem;
  }
  if (metrics.is_object())
    for (const auto& [key, value] : metrics.items())
      if (!entry.contains(key)) entry[key] = value;
  entry["passed"] = entry["outcome"] == outcome::kPassed;
  return entry;
}

}  // namespace chase::campaign
