#include "services/prediction/replan_trigger.h"

#include <cmath>
#include <cstdio>

namespace chase::prediction {

std::string TriggerConfig::Problem() const {
  const struct {
    const char* field;
    double value, low, high;
  } limits[] = {{"deviation", deviation, 0, 100},
                {"deviation_sigmas", deviation_sigmas, 0, 100},
                {"max_age", max_age, 0.001, 100},
                {"min_period", min_period, 0, 100}};
  for (const auto& limit : limits) {
    if (std::isfinite(limit.value) && limit.value >= limit.low && limit.value <= limit.high)
      continue;
    char text[160];
    std::snprintf(text, sizeof text, "%s: %g is not within %g to %g", limit.field, limit.value,
                  limit.low, limit.high);
    return text;
  }
  return "";
}

void ReplanTrigger::Lost() {
  lost_ = lost_ || running_.has_value();
  running_.reset();
}

std::optional<Cause> ReplanTrigger::Check(const PredictorConfig& predictor,
                                          const Situation& situation) const {
  if (!running_) return lost_ ? Cause::kReacquired : Cause::kFirst;
  const double age = situation.now - running_->trajectory.start;
  if (age < 0.0) return Cause::kExpiry;  // the clock was set back
  if (age < config_.min_period - 1e-9) return std::nullopt;
  if (situation.observed && HasLeft(*situation.observed, situation.now)) return Cause::kDeviation;
  // A prediction that is known to collide would trigger at every list of obstacles.
  if (running_->verdict == PredictResult::Verdict::kOk && situation.request &&
      !StaysClear(predictor, *situation.request, running_->trajectory))
    return Cause::kObstacle;
  if (age >= config_.max_age - 1e-9) return Cause::kExpiry;
  return std::nullopt;
}

bool ReplanTrigger::HasLeft(const math::Gaussian3& observed, double now) const {
  const double age = now - running_->trajectory.start;
  const Eigen::Vector3d predicted = running_->trajectory.Position(now);
  if ((observed.mean - predicted).norm() <= config_.deviation) return false;
  const math::Gaussian3 expected{predicted, observed.covariance + running_->position_covariance +
                                                age * age * running_->velocity_covariance};
  return math::SquaredMahalanobis(expected, observed.mean) >
         config_.deviation_sigmas * config_.deviation_sigmas;
}

}  // namespace chase::prediction
