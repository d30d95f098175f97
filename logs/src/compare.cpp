#include "logs/src/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

namespace chase::logs {
namespace {

using Json = nlohmann::ordered_json;

enum class Better { kHigher, kLower, kNearOne };

/// Those with a better side; numbers that only describe a flight, such as replans, have none.
const std::vector<std::pair<const char*, Better>>& Keys() {
  static const std::vector<std::pair<const char*, Better>> keys = {
      {"flown_s", Better::kHigher},
      {"safe_ratio", Better::kHigher},
      {"min_clearance_m", Better::kHigher},
      {"visible_ratio", Better::kHigher},
      {"in_image_ratio", Better::kHigher},
      {"distance_ratio", Better::kNearOne},
      {"distance_error", Better::kLower},
      {"acceleration_cost", Better::kLower},
      {"jerk_cost", Better::kLower},
      {"yaw_rate_rms", Better::kLower},
      {"plan_ms.p50", Better::kLower},
      {"plan_ms.p99", Better::kLower},
      {"predict_ms.p50", Better::kLower},
      {"predict_ms.p99", Better::kLower},
      {"sweep_to_setpoint_ms.p50", Better::kLower},
      {"sweep_to_setpoint_ms.p99", Better::kLower},
      {"fallbacks", Better::kLower},
      {"certified_clearance_m", Better::kHigher},
      {"certificate_kept_ratio", Better::kHigher},
      {"tube_exceeded_ratio", Better::kLower},
      {"tracking_error_p99_m", Better::kLower},
      {"odometry_ate_m", Better::kLower},
      {"target_rmse_m", Better::kLower},
      {"prediction_error_m", Better::kLower},
      {"real_time_factor", Better::kHigher},
      {"pose_sigma_max_m", Better::kLower},
      {"target_known_ratio", Better::kHigher},
      {"certified_ratio", Better::kHigher},
      {"tracking_error_m.p50", Better::kLower},
      {"tracking_error_m.p99", Better::kLower},
      {"latency_ms.POSE.p99", Better::kLower},
      {"latency_ms.TARGET.p99", Better::kLower},
      {"latency_ms.OBSTACLES.p99", Better::kLower},
      {"stages_ms.planning plan.p99", Better::kLower},
      {"reaction_s", Better::kLower},
      {"recovery_s", Better::kLower},
      {"nonfinite_setpoints", Better::kLower},
      {"touchdown_speed_mps", Better::kLower},
      {"motors_off_s", Better::kLower},
      {"uncertified_brakes", Better::kLower},
      {"accelerating_brakes", Better::kLower},
  };
  return keys;
}

/// The value under a key with points; null where there is none.
Json At(const Json& metrics, const std::string& key) {
  const size_t point = key.find('.');
  const auto found = metrics.find(key.substr(0, point));
  if (found == metrics.end()) return {};
  if (point == std::string::npos) return *found;
  return found->is_object() ? At(*found, key.substr(point + 1)) : Json();
}

/// Larger is worse.
double Badness(double value, Better better) {
  if (better == Better::kHigher) return -value;
  return better == Better::kLower ? value : std::abs(value - 1.0);
}

ComparedFigure Figure(const std::string& key, const Json& a, const Json& b, Better better,
                      double tolerance) {
  const auto text = [](const Json& v) {
    return v.is_number() ? fmt::format("{:.4g}", v.get<double>()) : std::string();
  };
  ComparedFigure figure{key, text(a), text(b), a.is_number() && !b.is_number()};
  if (!a.is_number() || !b.is_number()) return figure;
  const double before = a.get<double>(), after = b.get<double>();
  const double moved = Badness(after, better) - Badness(before, better);
  figure.worse = moved > tolerance * std::max(std::abs(before), std::abs(after));
  return figure;
}

}  // namespace

std::vector<ComparedFigure> CompareMetrics(const std::string& a, const std::string& b,
                                           double tolerance) {
  const Json before = Json::parse(a), after = Json::parse(b);
  std::vector<ComparedFigure> figures;
  for (const auto& [key, better] : Keys())
    figures.push_back(Figure(key, At(before, key), At(after, key), better, tolerance));
  std::map<std::string, std::pair<std::string, std::string>> criteria;
  const auto word = [](const Json& passed) { return passed.get<bool>() ? "passed" : "FAILED"; };
  const Json held_before = At(before, "criteria"), held_after = At(after, "criteria");
  for (const auto& [name, passed] : held_before.items()) criteria[name].first = word(passed);
  for (const auto& [name, passed] : held_after.items()) criteria[name].second = word(passed);
  for (const auto& [name, held] : criteria)
    figures.push_back({"criteria." + name, held.first, held.second,
                       held.first == "passed" && held.second != "passed"});
  return figures;
}

std::string Format(const std::vector<ComparedFigure>& figures) {
  const auto shown = [](const std::string& text) { return text.empty() ? "not known" : text; };
  std::string out = fmt::format("{:<30} {:>12} {:>12}\n", "", "A", "B");
  for (const ComparedFigure& f : figures)
    if (!f.a.empty() || !f.b.empty())
      out += fmt::format("{:<30} {:>12} {:>12}{}\n", f.key, shown(f.a), shown(f.b),
                         f.worse ? "  WORSE" : "");
  const auto worse = std::count_if(figures.begin(), figures.end(),
                                   [](const ComparedFigure& f) { return f.worse; });
  return out + (worse == 0 ? "B is worse in nothing\n" : fmt::format("B is worse in {}\n", worse));
}

}  // namespace chase::logs
