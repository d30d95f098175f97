#include "services/prediction/observation_window.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "common/math/gaussian.h"

namespace chase::prediction {
namespace {

constexpr double kSameStamp = 1e-6;  // s
constexpr int kGateMinimum = 3;      // fewer do not tell where the next one should be

std::string OutOfRange(const char* field, double value, double low, double high) {
  if (std::isfinite(value) && value >= low && value <= high) return "";
  char text[160];
  std::snprintf(text, sizeof text, "%s: %g is not within %g to %g", field, value, low, high);
  return text;
}

// Where the straight line through the observations is at time t, and the variance of that place
// for a unit variance of each.
struct LinePrediction {
  Eigen::Vector3d place;
  double variance;
};

LinePrediction Extrapolate(const std::vector<Observation>& observations, double t) {
  const double n = static_cast<double>(observations.size());
  double mean_t = 0.0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Observation& o : observations) mean_t += (o.t - t) / n, mean += o.mean / n;
  double spread = 0.0;
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  for (const Observation& o : observations) {
    const double dt = o.t - t - mean_t;
    spread += dt * dt;
    slope += dt * (o.mean - mean);
  }
  if (spread < 1e-9) return {mean, 1.0 / n};
  return {mean - mean_t * slope / spread, 1.0 / n + mean_t * mean_t / spread};
}

Observation Merge(const std::vector<Observation>& group) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weight = 0.0, time = 0.0;
  const Eigen::Vector3d origin = group.front().mean;
  for (const Observation& o : group) {
    const Eigen::Matrix3d inverse = math::MadePositiveDefinite(o.covariance, 1e-8).inverse();
    information += inverse;
    sum += inverse * (o.mean - origin);
    time += inverse.trace() * (o.t - group.front().t);
    weight += inverse.trace();
  }
  const Eigen::Matrix3d covariance = information.inverse();
  return {group.front().t + time / weight, origin + covariance * sum, covariance};
}

}  // namespace

std::string WindowConfig::Problem() const {
  const struct {
    const char* field;
    double value, low, high;
  } limits[] = {
      {"observations", static_cast<double>(observations), 2, 32},
      {"length", length, 0.05, 60},
      {"gate_span", gate_span, 0.05, 60},
      {"gate_sigmas", gate_sigmas, 0.1, 1e3},
      {"gate_acceleration", gate_acceleration, 0, 1e3},
      {"gate_recovery", static_cast<double>(gate_recovery), 1, 1000},
      {"sigma_floor", sigma_floor, 1e-4, 10},
  };
  for (const auto& limit : limits) {
    const std::string problem = OutOfRange(limit.field, limit.value, limit.low, limit.high);
    if (!problem.empty()) return problem;
  }
  return "";
}

void ObservationWindow::Clear() {
  kept_.clear();
  outliers_.clear();
}

ObservationWindow::Outcome ObservationWindow::Add(const Observation& o) {
  if (!std::isfinite(o.t) || !o.mean.allFinite() || !o.covariance.allFinite())
    return Outcome::kInvalid;
  for (const auto* list : {&kept_, &outliers_})
    for (const Observation& k : *list)
      if (std::abs(k.t - o.t) < kSameStamp) return Outcome::kDuplicate;
  if (!kept_.empty() && o.t < newest() - config_.length) return Outcome::kTooOld;
  if (IsOutlier(o)) return TakeOutlier(o);
  outliers_.clear();
  Insert(o);
  return Outcome::kTaken;
}

// The line through the newest observations, allowed to be off by what the acceleration does
// between its middle and the new stamp.
bool ObservationWindow::IsOutlier(const Observation& o) const {
  std::vector<Observation> recent;
  for (const Observation& k : kept_)
    if (k.t >= o.t - config_.length && k.t >= newest() - config_.gate_span) recent.push_back(k);
  if (static_cast<int>(recent.size()) < kGateMinimum) return false;
  const LinePrediction line = Extrapolate(recent, o.t);
  double middle = 0.0;
  for (const Observation& k : recent) middle += k.t / static_cast<double>(recent.size());
  const double dt = o.t - middle;
  const double bend = 0.5 * config_.gate_acceleration * dt * dt;
  const Eigen::Matrix3d own =
      math::MadePositiveDefinite(o.covariance, config_.sigma_floor * config_.sigma_floor);
  const double largest = own.trace() * line.variance + bend * bend;
  const math::Gaussian3 expected{line.place, own + largest * Eigen::Matrix3d::Identity()};
  return math::SquaredMahalanobis(expected, o.mean) > config_.gate_sigmas * config_.gate_sigmas;
}

ObservationWindow::Outcome ObservationWindow::TakeOutlier(const Observation& o) {
  outliers_.push_back(o);
  if (static_cast<int>(outliers_.size()) < config_.gate_recovery) return Outcome::kOutlier;
  kept_.clear();
  for (const Observation& outlier : std::exchange(outliers_, {})) Insert(outlier);
  return Outcome::kRestarted;
}

void ObservationWindow::Insert(const Observation& o) {
  const auto after =
      std::upper_bound(kept_.begin(), kept_.end(), o,
                       [](const Observation& a, const Observation& b) { return a.t < b.t; });
  kept_.insert(after, o);
  const double oldest = newest() - config_.length;
  kept_.erase(std::remove_if(kept_.begin(), kept_.end(),
                             [oldest](const Observation& k) { return k.t < oldest - kSameStamp; }),
              kept_.end());
}

std::vector<Observation> ObservationWindow::Merged() const {
  std::vector<Observation> merged, group;
  if (kept_.empty()) return merged;
  const double span = config_.length / config_.observations;
  int current = -1;
  for (const Observation& o : kept_) {
    const int index = std::min(config_.observations - 1, static_cast<int>((newest() - o.t) / span));
    if (index != current && !group.empty()) merged.push_back(Merge(std::exchange(group, {})));
    current = index;
    group.push_back(o);
  }
  merged.push_back(Merge(group));
  return merged;
}

}  // namespace chase::prediction
