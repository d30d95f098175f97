#include "services/perception/place/localiser.h"

#include <algorithm>
#include <cmath>

#include "services/perception/place/hypotheses.h"
#include "services/perception/place/target_points.h"

namespace chase::perception {

namespace {

// Greatest squared Mahalanobis distance from the prediction, 6 dof.
constexpr double kPriorGate = 30.0;
constexpr double kSharpTurn = 0.02;   // how often the target does what the motion leaves out
constexpr double kClear = 3.0;        // squared distance from the prediction that needs no other
constexpr int kFewRays = 3;           // through it, as the edge of a thing may let pass
constexpr double kEdgeGate = 3.0;     // standard deviations of an edge that is the target's
constexpr int kLeastSides = 2;        // that must be seen; one where the lidar surely hit it
constexpr int kMostClusters = 2;      // that are tried
constexpr double kMinVisible = 0.15;  // share of the expected box that a detection must cover
constexpr double kHiddenPriorShare = 0.6;  // of the prior's gate where sides are left out

bool Visible(const FitInput& input) {
  if (input.detection->p_CT) return true;
  const auto expected = ProjectTarget(input.camera, input.prior.position(), input.shape);
  return !expected || input.detection->box.area() >= kMinVisible * expected->area();
}

/// The sides of a reading that the detection shows.
Sides Seen(Sides sides, const Detection& d) {
  for (size_t i = 0; i < sides.size(); ++i) sides[i] = sides[i] && !d.silhouette.samples[i].empty();
  return sides;
}

bool GoesOn(const Detection& d) {
  return std::any_of(d.goes_on.begin(), d.goes_on.end(), [](bool on) { return on; });
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

}  // namespace

bool Localiser::Agrees(const FitResult& fit, double prior_gate) const {
  if (!fit.ok || fit.prior_distance > prior_gate) return false;
  return fit.point_rms <= 3.0 * config_.fit.lidar_sigma;
}

bool Localiser::EdgesAgree(const FitResult& fit, const FitInput& input) const {
  const auto least = input.points.size() < kSurelyHit ? kLeastSides : 1;
  if (!input.detection->p_CT && std::count(fit.used.begin(), fit.used.end(), true) < least)
    return false;
  const double gate = kEdgeGate * input.detection->silhouette.sigma_px;
  for (size_t side = 0; side < 4; ++side) {
    if (fit.used[side] && std::abs(fit.edge_px[side]) > gate) return false;
    const bool left_out =
        !input.use_side[side] && !input.detection->silhouette.samples[side].empty();
    if (left_out && std::abs(fit.edge_px[side]) < HiddenBy(input)) return false;
    // Where the range is not known, what goes on beyond a side is a larger thing.
    if (left_out && fit.edge_px[side] > 0.0 && !RangeIsKnown(input)) return false;
  }
  return true;
}

std::optional<FitResult> Localiser::WholeReading(FitInput* input) const {
  input->use_side = kReadings[0];
  FitResult fit = FitTarget(*input, config_.fit);
  if (!Agrees(fit, kPriorGate) || !EdgesAgree(fit, *input)) return std::nullopt;
  return fit;
}

void Localiser::Weigh(const FitInput& given, double log_prior, size_t readings,
                      std::vector<Hypothesis>* out) const {
  FitInput input = given;
  // Where a like colour goes on, both sides may be another thing's, as the points tell.
  const bool joined = !input.points.empty() && (input.joined || GoesOn(*input.detection));
  std::vector<Sides> tried;
  bool explained = !joined && !out->empty();
  for (size_t k = 0; k < readings; ++k) {
    if (k >= kOneHidden && explained) return;
    const Sides seen = Seen(kReadings[k], *input.detection);
    if (std::count(tried.begin(), tried.end(), seen) > 0) continue;
    tried.push_back(seen);
    input.use_side = kReadings[k];
    const FitResult fit = FitTarget(input, config_.fit);
    const double gate = k == 0 ? kPriorGate : kHiddenPriorShare * kPriorGate;
    if (!Agrees(fit, gate) || !EdgesAgree(fit, input)) continue;
    out->push_back({fit, log_prior + LogTarget(fit, input, config_.fit)});
    explained = explained || (!joined && RaysThrough(input, fit.posterior) < kFewRays);
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
  // Where the range is not known, two opposite sides must give it.
  const bool known = RangeIsKnown(*input);
  Weigh(*input, std::log(1.0 - kSharpTurn), known ? kReadings.size() : kOneHidden, &all);
  Weigh(AfterASharpTurn(*input), std::log(kSharpTurn), kOneHidden, &all);
  if (all.empty()) return std::nullopt;
  FitResult fit = Joined(all);
  fit.log_odds -= log_clutter;
  return fit;
}

std::optional<FitResult> Localiser::Correct(const FitInput& predicted,
                                            const Clusters& clusters) const {
  if (!Visible(predicted)) return std::nullopt;
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
