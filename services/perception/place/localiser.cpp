#include "services/perception/place/localiser.h"

#include <algorithm>
#include <cmath>

#include "services/perception/place/hypotheses.h"
#include "services/perception/place/target_points.h"

namespace chase::perception {

namespace {

// Greatest squared Mahalanobis distance from the prediction, 6 dof.
constexpr double kPriorGate = 30.0;
constexpr double kClear = 3.0;           // squared distance from the prediction that needs no other
constexpr int kFewRays = 3;              // through it, as the edge of a thing may let pass
constexpr int kManyRays = 5;             // through it: the target is not there
constexpr double kEdgeGate = 3.0;        // standard deviations of an edge that is the target's
constexpr int kLeastSides = 2;           // that must be seen; one where the lidar surely hit it
constexpr int kSidesOfNew = 3;           // of what nothing is known of yet
constexpr double kHitRange = 0.3;        // m, standard deviation of a range from points
constexpr double kSizedShare = 0.4;      // of the range, likewise from the width alone
constexpr double kMaxRangeError = 0.15;  // share of the range; a worse first fix is none

/// The sides of a reading that the detection shows.
Sides Seen(Sides sides, const Detection& d) {
  for (size_t i = 0; i < sides.size(); ++i) sides[i] = sides[i] && !d.silhouette.samples[i].empty();
  return sides;
}

/// One Gaussian with the mean and covariance of the mixture; all else from the likeliest.
FitResult Joined(const std::vector<FitResult>& all) {
  const FitResult& best = *std::max_element(
      all.begin(), all.end(),
      [](const FitResult& a, const FitResult& b) { return a.log_odds < b.log_odds; });
  FitResult out = best;
  double total = 0.0;
  Vector6d mean = Vector6d::Zero();
  Matrix6d square = Matrix6d::Zero();
  for (const auto& fit : all) {
    const double weight = std::exp(fit.log_odds - best.log_odds);
    const Vector6d off = fit.posterior.mean - best.posterior.mean;
    total += weight;
    mean += weight * off;
    square += weight * (fit.posterior.covariance + off * off.transpose());
  }
  mean /= total;
  out.posterior.mean += mean;
  out.posterior.covariance = square / total - mean * mean.transpose();
  out.log_odds += std::log(total);
  return out;
}

}  // namespace

bool Localiser::Agrees(const FitResult& fit, const FitInput& input) const {
  if (!fit.ok || fit.prior_distance > kPriorGate || fit.point_rms > 3.0 * config_.fit.lidar_sigma)
    return false;
  const auto least = input.points.size() < kSurelyHit ? kLeastSides : 1;
  if (!input.detection->p_CT && std::count(fit.used.begin(), fit.used.end(), true) < least)
    return false;
  const double gate = kEdgeGate * input.detection->silhouette.sigma_px;
  for (size_t side = 0; side < 4; ++side)
    if (fit.used[side] && std::abs(fit.edge_px[side]) > gate) return false;
  return true;
}

std::optional<FitResult> Localiser::JoinedReading(FitInput* input) const {
  const double log_clutter = LogClutter(*input);
  // Where the range is not known, two opposite sides must give it.
  const size_t readings = RangeIsKnown(*input) ? kReadings.size() : kOneHidden;
  std::vector<FitResult> all;
  std::vector<Sides> tried;
  bool explained = false;
  for (size_t k = 0; k < readings && !(k >= kOneHidden && explained); ++k) {
    const Sides seen = Seen(kReadings[k], *input->detection);
    if (std::count(tried.begin(), tried.end(), seen) > 0) continue;
    tried.push_back(seen);
    input->use_side = kReadings[k];
    FitResult fit = FitTarget(*input, config_.fit);
    if (!Agrees(fit, *input)) continue;
    fit.log_odds = LogTarget(fit, *input, config_.fit) - log_clutter;
    all.push_back(fit);
    const bool opaque = RaysThrough(*input, fit.posterior) < kFewRays;
    if (k == 0 && opaque && fit.prior_distance < kClear) break;
    explained = explained || opaque;
  }
  return all.empty() ? std::nullopt : std::make_optional(Joined(all));
}

std::optional<FitResult> Localiser::Correct(const FitInput& predicted,
                                            const Clusters& clusters) const {
  FitInput input = predicted;
  input.hits = &clusters;
  const double gate = kLidarGate + 2.0 * RangeSigma(predicted.prior, predicted.camera);
  for (const auto& cluster : clusters) {
    input.points = PointsOnTarget(predicted, cluster, gate);
    if (!input.points.empty()) break;
  }
  if (!input.points.empty())
    if (const auto fit = JoinedReading(&input)) return fit;
  input.points.clear();
  if (RaysThrough(input, predicted.prior) >= kManyRays) return std::nullopt;
  return JoinedReading(&input);
}

/// What is more likely half of a target than anything else. Its range must be known; what goes on
/// beyond it is a larger thing.
std::optional<FitResult> Localiser::PartialReading(FitInput input) const {
  if (input.points.size() < kSurelyHit) return std::nullopt;
  input.reappears = true;
  const auto fit = JoinedReading(&input);
  return fit && !fit->whole && !fit->joined && fit->log_odds > 0.0 ? fit : std::nullopt;
}

std::optional<FitResult> Localiser::NewReading(FitInput* input) const {
  input->use_side = kReadings[0];
  const FitResult fit = FitTarget(*input, config_.fit);
  if (!Agrees(fit, *input)) return std::nullopt;
  const auto sides = std::count(fit.used.begin(), fit.used.end(), true);
  const double range = (fit.posterior.position() - input->camera.p_WC).norm();
  const bool ranged = RangeSigma(fit.posterior, input->camera) < kMaxRangeError * range;
  if (!ranged || !(input->detection->p_CT || sides >= kSidesOfNew)) return std::nullopt;
  return fit;
}

std::optional<FitResult> Localiser::Acquire(const TargetShape& shape, const Camera& camera,
                                            const Detection& detection,
                                            const Clusters& clusters) const {
  FitInput input;
  input.shape = shape;
  input.camera = camera;
  input.detection = &detection;
  for (const auto& cluster : clusters) {
    if (!GivesRange(cluster)) continue;
    const double range = MedianRange(cluster) + shape.size[0];
    const auto most = BoxAtRange(camera, detection.box, range, Round(shape, shape.MostHalfWidth()));
    if (most && detection.LargerThan(*most)) continue;
    input.prior = NewTarget(camera, detection.box, shape, range, kHitRange);
    input.points = PointsOnTarget(input, cluster, 2.0 * kLidarGate);
    if (const auto fit = NewReading(&input)) return fit;
    if (const auto fit = PartialReading(input)) return fit;
  }
  // From the size alone: every side must be seen, since nothing tells what is hidden.
  if (!detection.p_CT && detection.AnyCut()) return std::nullopt;
  const double range =
      detection.p_CT ? detection.p_CT->norm() : RangeBySize(camera, detection.box, shape);
  input.prior = NewTarget(camera, detection.box, shape, range, kSizedShare * range);
  input.points.clear();
  const auto fit = NewReading(&input);
  input.hits = &clusters;
  return fit && RaysThrough(input, fit->posterior) < kManyRays ? fit : std::nullopt;
}

}  // namespace chase::perception
