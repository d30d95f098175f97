#include "services/prediction/predictor_config.h"

#include <cmath>
#include <cstdio>

namespace chase::prediction {
namespace {

std::string OutOfRange(const char* field, double value, double low, double high) {
  if (std::isfinite(value) && value >= low && value <= high) return "";
  char text[160];
  std::snprintf(text, sizeof text, "%s: %g is not within %g to %g", field, value, low, high);
  return text;
}

}  // namespace

std::string PredictorConfig::Problem() const {
  const struct {
    const char* field;
    double value, low, high;
  } limits[] = {
      {"samples", static_cast<double>(samples), 1, 16},
      {"steps", static_cast<double>(steps), 2, 32},
      {"degree", static_cast<double>(degree), 1, 7},
      {"horizon", horizon, 0.1, 20},
      {"fit_weight", fit_weight, 1e-6, 1e6},
      {"damping", damping, 0, 1e6},
      {"density_weight", density_weight, 0, 1e12},
      {"contour_sigmas", contour_sigmas, 0, 20},
      {"sigma_floor", sigma_floor, 1e-4, 10},
      {"spread", spread, 1e-4, 10},
      {"max_target_speed", max_target_speed, 0.01, 100},
      {"inflation", inflation, 0, 10},
      {"overlap_tolerance", overlap_tolerance, 0, 0.9},
      {"smallest_shrink", smallest_shrink, 0, 1},
      {"table_limit", static_cast<double>(table_limit), 1, 4e6},
      {"visit_limit", static_cast<double>(visit_limit), 1, 1e9},
      {"node_limit", static_cast<double>(node_limit), 1, 1e6},
  };
  for (const auto& limit : limits) {
    const std::string problem = OutOfRange(limit.field, limit.value, limit.low, limit.high);
    if (!problem.empty()) return problem;
  }
  const std::string problem = motion.Problem();
  return problem.empty() ? "" : "motion." + problem;
}

}  // namespace chase::prediction
