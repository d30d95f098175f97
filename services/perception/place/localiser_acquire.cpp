// How a Localiser places a target of which nothing is known.
#include <algorithm>
#include <cmath>

#include "services/perception/place/localiser.h"
#include "services/perception/place/target_points.h"

namespace chase::perception {

namespace {

constexpr int kSidesOfNew = 3;           // of what nothing is known of yet
constexpr double kSizedRange = 0.24;     // m, standard deviation of a range from one size alone
constexpr double kMaxRangeError = 0.15;  // share of the range; a worse first fix is none
constexpr double kLarger = 1.15, kLargerSigmas = 6.0;  // times its size, and of an edge more

/// True for a detection that the target cannot fill at this range.
bool LargerThanTarget(const FitInput& input, double range) {
  const double px = kLarger * input.camera.rig.focal_px / range;
  const double more = kLargerSigmas * input.detection->silhouette.sigma_px;
  const auto& box = input.detection->box;
  return box.width > 2.0 * px * input.shape.MostHalfWidth() + more ||
         box.height > px * input.shape.size[1] + more;
}

}  // namespace

TargetGaussian Localiser::Guess(const Camera& camera, const Detection& detection, double range,
                                double range_sigma) const {
  const Eigen::Vector3d sight = camera
                                    .Ray(detection.box.x + 0.5 * detection.box.width,
                                         detection.box.y + 0.5 * detection.box.height)
                                    .normalized();
  const double side_sigma = 0.5 * config_.target_height + 0.1 * range;
  TargetGaussian g;
  g.mean.head<3>() = camera.p_WC + range * sight;
  g.covariance.topLeftCorner<3, 3>() = side_sigma * side_sigma * Eigen::Matrix3d::Identity() +
                                       range_sigma * range_sigma * sight * sight.transpose();
  g.ForgetVelocity();
  return g;
}

/// Half of a target whose range the points tell; what goes on beyond it is a larger thing.
std::optional<FitResult> Localiser::AcquirePartial(FitInput* input,
                                                   const Clusters& clusters) const {
  for (const auto& cluster : clusters) {
    if (cluster.size() < kSurelyHit) continue;
    const double range = MedianRange(cluster) + input->shape.size[0];
    if (LargerThanTarget(*input, range)) continue;
    input->prior = Guess(input->camera, *input->detection, range, 0.3);
    input->points = PointsOnTarget(*input, cluster, 2.0 * kLidarGate);
    if (input->points.size() < kSurelyHit) continue;
    input->reappears = true;
    const auto fit = JoinedReading(input);
    input->reappears = false;
    if (fit && !fit->joined && !fit->whole && fit->log_odds > 0.0) return fit;
  }
  return std::nullopt;
}

/// Likewise where three sides are seen and two of them tell the range: what hides the fourth, or
/// stands right above or below, must not keep it from being followed.
std::optional<FitResult> Localiser::AcquirePartialBySize(FitInput* input) const {
  const auto& d = *input->detection;
  const auto seen = [&](Side side) { return !d.silhouette.samples[side].empty(); };
  const auto& size = input->shape.size;
  const double focal = input->camera.rig.focal_px;
  std::vector<double> ranges;
  if (seen(kTop) && seen(kBottom)) ranges.push_back(focal * size[1] / d.box.height);
  if (d.edged && seen(kLeft) && seen(kRight))
    ranges.push_back(focal * 2.0 * input->shape.MeanHalfWidth() / d.box.width);
  for (const double range : ranges) {
    input->prior = Guess(input->camera, d, range, kSizedRange);
    input->points.clear();
    input->reappears = true;
    const auto fit = JoinedReading(input);
    input->reappears = false;
    if (!fit || fit->whole || fit->log_odds <= 0.0) continue;
    if (std::count(fit->used.begin(), fit->used.end(), true) < kSidesOfNew) continue;
    if (fit->joined && !(d.edged && fit->used[kLeft] && fit->used[kRight])) continue;
    return fit;
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
    input.prior = Guess(camera, detection, range, 0.3);
    input.points = PointsOnTarget(input, cluster, 2.0 * kLidarGate);
    const auto fit = WholeReading(&input);
    if (good(fit)) return fit;
  }
  if (const auto hit = AcquirePartial(&input, clusters)) return hit;
  const auto not_through = [&](const std::optional<FitResult>& fit) {
    if (!fit) return fit;
    input.prior = fit->posterior;
    return SeenThrough(input, clusters) ? std::nullopt : fit;
  };
  // From the size alone: every side must be seen, since nothing tells what is hidden.
  const auto partial = [&]() -> std::optional<FitResult> {
    if (detection.p_CT) return std::nullopt;
    const auto fit = not_through(AcquirePartialBySize(&input));
    if (fit && HitElsewhere(input, clusters)) return std::nullopt;
    return fit;
  };
  if (!detection.p_CT && detection.AnyCut()) return partial();
  const double range = detection.p_CT ? detection.p_CT->norm()
                                      : camera.rig.focal_px * 2.0 * shape.MeanHalfWidth() /
                                            std::max(1.0, detection.box.width);
  input.prior = Guess(camera, detection, range, 0.4 * range);
  input.points.clear();
  const auto fit = WholeReading(&input);
  if (!good(fit)) return partial();
  return not_through(fit);
}

}  // namespace chase::perception
