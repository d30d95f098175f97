// How a Localiser places a target of which nothing is known.
#include <algorithm>
#include <cmath>

#include "services/perception/place/hypotheses.h"
#include "services/perception/place/localiser.h"
#include "services/perception/place/target_points.h"

namespace chase::perception {

namespace {

constexpr int kSidesOfNew = 3;           // of what nothing is known of yet
constexpr double kHitRange = 0.3;        // m, standard deviation of a range from points
constexpr double kSizedShare = 0.4;      // of the range, likewise from the width alone
constexpr double kMaxRangeError = 0.15;  // share of the range; a worse first fix is none
constexpr double kLarger = 1.15, kLargerSigmas = 6.0;  // times its size, and of an edge more

/// True for a detection that the target cannot fill at this range.
bool LargerThanTarget(const FitInput& input, double range) {
  const auto& box = input.detection->box;
  const double more = kLargerSigmas * input.detection->silhouette.sigma_px;
  const auto most =
      BoxAtRange(input.camera, box, range, Round(input.shape, input.shape.MostHalfWidth()));
  return most &&
         (box.width > kLarger * most->width + more || box.height > kLarger * most->height + more);
}

}  // namespace

/// What is more likely part of a target than anything else.
std::optional<FitResult> Localiser::PartialReading(FitInput input) const {
  input.reappears = true;
  const auto fit = JoinedReading(&input);
  return fit && !fit->whole && !fit->joined && fit->log_odds > 0.0 ? fit : std::nullopt;
}

/// Half of a target whose range the points tell; what goes on beyond it is a larger thing.
std::optional<FitResult> Localiser::AcquirePartial(FitInput* input,
                                                   const Clusters& clusters) const {
  for (const auto& cluster : clusters) {
    if (cluster.size() < kSurelyHit) continue;
    const double range = MedianRange(cluster) + input->shape.size[0];
    if (LargerThanTarget(*input, range)) continue;
    input->prior = NewTarget(input->camera, input->detection->box, input->shape, range, kHitRange);
    input->points = PointsOnTarget(*input, cluster, 2.0 * kLidarGate);
    if (input->points.size() < kSurelyHit) continue;
    if (const auto fit = PartialReading(*input)) return fit;
  }
  return std::nullopt;
}

std::optional<FitResult> Localiser::Acquire(const TargetShape& shape, const Camera& camera,
                                            const Detection& detection,
                                            const Clusters& clusters) const {
  const auto good = [&](const std::optional<FitResult>& fit) {
    if (!fit) return false;
    if (!detection.p_CT && std::count(fit->used.begin(), fit->used.end(), true) < kSidesOfNew)
      return false;
    const double range = (fit->posterior.position() - camera.p_WC).norm();
    return RangeSigma(fit->posterior, camera) < kMaxRangeError * range;
  };
  FitInput input;
  input.shape = shape;
  input.camera = camera;
  input.detection = &detection;
  for (const auto& cluster : clusters) {
    if (!GivesRange(cluster)) continue;
    const double range = MedianRange(cluster) + shape.size[0];
    input.prior = NewTarget(camera, detection.box, shape, range, kHitRange);
    input.points = PointsOnTarget(input, cluster, 2.0 * kLidarGate);
    const auto fit = WholeReading(&input);
    if (good(fit)) return fit;
  }
  if (const auto hit = AcquirePartial(&input, clusters)) return hit;
  // From the size alone: every side must be seen, since nothing tells what is hidden.
  if (!detection.p_CT && detection.AnyCut()) return std::nullopt;
  const double range =
      detection.p_CT ? detection.p_CT->norm() : RangeBySize(camera, detection.box, shape);
  input.prior = NewTarget(camera, detection.box, shape, range, kSizedShare * range);
  input.points.clear();
  const auto fit = WholeReading(&input);
  if (!good(fit)) return std::nullopt;
  input.prior = fit->posterior;
  return SeenThrough(input, clusters) ? std::nullopt : fit;
}

}  // namespace chase::perception
