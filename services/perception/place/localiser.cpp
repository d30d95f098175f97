#include "services/perception/place/localiser.h"

#include <algorithm>
#include <cmath>

#include "services/perception/place/hypotheses.h"
#include "services/perception/place/target_points.h"

namespace chase::perception {

namespace {

// Greatest squared Mahalanobis distance from the prediction, 6 dof.
constexpr double kPriorGate = 30.0;
constexpr double kSharpTurn = 0.02;  // how often the target does what the motion leaves out
constexpr double kClear = 3.0;       // squared distance from the prediction that needs no other
constexpr int kFewRays = 3;          // through it, as the edge of a thing may let pass
constexpr double kEdgeGate = 3.0;    // standard deviations of an edge that is the target's
constexpr int kLeastSides = 2;       // that must be seen; one where the lidar surely hit it
constexpr int kMostClusters = 2;     // that are tried

/// The sides of a reading that the detection shows.
Sides Seen(Sides sides, const Detection& d) {
  for (size_t i = 0; i < sides.size(); ++i) sides[i] = sides[i] && !d.silhouette.samples[i].empty();
  return sides;
}

/// One Gaussian with the mean and covariance of the mixture; all else from the likeliest.
FitResult Joined(const std::vector<Hypothesis>& all) {
  const Hypothesis& best = *std::max_element(
      all.begin(), all.end(),
      [](const Hypothesis& a, const Hypothesis& b) { return a.log_weight < b.log_weight; });
  FitResult out = best.fit;
  double total = 0.0;
  Vector6d mean = Vector6d::Zero();
  Matrix6d square = Matrix6d::Zero();
  for (const auto& h : all) {
    const double weight = std::exp(h.log_weight - best.log_weight);
    const Vector6d off = h.fit.posterior.mean - best.fit.posterior.mean;
    total += weight;
    mean += weight * off;
    square += weight * (h.fit.posterior.covariance + off * off.transpose());
  }
  mean /= total;
  out.posterior.mean += mean;
  out.posterior.covariance = square / total - mean * mean.transpose();
  out.log_odds = best.log_weight + std::log(total);
  return out;
}

/// True for a fit that agrees with the prediction and with the sides that it uses.
bool Agrees(const FitResult& fit, const FitInput& input) {
  if (!fit.ok || fit.prior_distance > kPriorGate) return false;
  const auto least = input.points.size() < kSurelyHit ? kLeastSides : 1;
  if (!input.detection->p_CT && std::count(fit.used.begin(), fit.used.end(), true) < least)
    return false;
  const double gate = kEdgeGate * input.detection->silhouette.sigma_px;
  for (size_t side = 0; side < 4; ++side)
    if (fit.used[side] && std::abs(fit.edge_px[side]) > gate) return false;
  return true;
}

}  // namespace

std::optional<FitResult> Localiser::WholeReading(FitInput* input) const {
  input->use_side = kReadings[0];
  FitResult fit = FitTarget(*input, config_.fit);
  if (!Agrees(fit, *input)) return std::nullopt;
  return fit;
}

void Localiser::Weigh(const FitInput& given, double log_prior, size_t readings,
                      std::vector<Hypothesis>* out) const {
  FitInput input = given;
  std::vector<Sides> tried;
  bool explained = !out->empty();
  for (size_t k = 0; k < readings; ++k) {
    if (k >= kOneHidden && explained) return;
    const Sides seen = Seen(kReadings[k], *input.detection);
    if (std::count(tried.begin(), tried.end(), seen) > 0) continue;
    tried.push_back(seen);
    input.use_side = kReadings[k];
    const FitResult fit = FitTarget(input, config_.fit);
    if (!Agrees(fit, input)) continue;
    out->push_back({fit, log_prior + LogTarget(fit, input, config_.fit)});
    explained = explained || RaysThrough(input, fit.posterior) < kFewRays;
  }
}

std::optional<FitResult> Localiser::JoinedReading(FitInput* input) const {
  const double log_clutter = LogClutter(*input);
  const auto whole = WholeReading(input);
  const bool clear =
      whole && whole->prior_distance < kClear && RaysThrough(*input, whole->posterior) < kFewRays;
  if (clear) {
    FitResult fit = *whole;
    fit.log_odds = LogTarget(fit, *input, config_.fit) - log_clutter;
    return fit;
  }
  std::vector<Hypothesis> all;
  Weigh(*input, std::log(1.0 - kSharpTurn), kReadings.size(), &all);
  Weigh(AfterASharpTurn(*input), std::log(kSharpTurn), kOneHidden, &all);
  if (all.empty()) return std::nullopt;
  FitResult fit = Joined(all);
  fit.log_odds -= log_clutter;
  return fit;
}

std::optional<FitResult> Localiser::Correct(const FitInput& predicted,
                                            const Clusters& clusters) const {
  FitInput input = predicted;
  input.hits = &clusters;
  const double gate = kLidarGate + 2.0 * RangeSigma(predicted.prior, predicted.camera);
  // What stands before the target may lend the blob's edge a few points, and what stands behind it
  // too: the likeliest fit is taken.
  std::optional<FitResult> best;
  int tried = 0;
  for (const auto& cluster : clusters) {
    input.points = PointsOnTarget(predicted, cluster, gate);
    if (input.points.empty()) continue;
    if (++tried > kMostClusters) break;
    const auto fit = JoinedReading(&input);
    if (fit && (!best || fit->log_odds > best->log_odds)) best = fit;
  }
  if (best) return best;
  input.points.clear();
  if (SeenThrough(predicted, clusters)) return std::nullopt;
  return JoinedReading(&input);
}

}  // namespace chase::perception
