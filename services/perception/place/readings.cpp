#include "services/perception/place/readings.h"

#include <algorithm>
#include <cmath>

#include "services/perception/place/target_points.h"

namespace chase::perception {

namespace {

constexpr double kHiddenBy = 2.0;     // standard deviations of an edge
constexpr double kTurnSpeed = 1.0;    // m/s, standard deviation of the speed a sharp turn adds
constexpr double kTurnShift = 0.12;   // m, and of the place
constexpr double kKnownShare = 0.03;  // of the range, standard deviation of the prediction
constexpr double kKnownRange = 0.25;  // m, likewise
constexpr double kSizeError = 0.1;    // share of the width that the outline may err by

}  // namespace

double HiddenBy(const FitInput& input) { return kHiddenBy * input.detection->silhouette.sigma_px; }

bool RangeIsKnown(const FitInput& input) {
  return !input.points.empty() || RangeSigma(input.prior, input.camera) < kKnownRange;
}

FitInput AfterASharpTurn(const FitInput& input) {
  Eigen::Vector2d sight = (input.prior.position() - input.camera.p_WC).head<2>().normalized();
  Eigen::Matrix2d across = Eigen::Matrix2d::Identity();
  if (input.points.empty()) across -= sight * sight.transpose();
  FitInput turned = input;
  turned.prior.covariance.topLeftCorner<2, 2>() += kTurnShift * kTurnShift * across;
  turned.prior.covariance.block<2, 2>(3, 3) += kTurnSpeed * kTurnSpeed * across;
  if (!input.points.empty()) turned.shape.yaw_variance = TargetShape::kAnyYaw;
  return turned;
}

std::optional<FitInput> AtRangeOf(const std::vector<TargetPoint>& cluster, const FitInput& input) {
  if (!GivesRange(cluster)) return std::nullopt;
  const double range = MedianRange(cluster) + input.shape.size[0];
  const double px = input.camera.rig.focal_px / range, seen = 0.5 * input.detection->box.width / px;
  if (seen < (1.0 - kSizeError) * input.shape.size[0] ||
      seen > (1.0 + kSizeError) * input.shape.MostHalfWidth())
    return std::nullopt;
  const Eigen::Vector3d to_prior = input.prior.position() - input.camera.p_WC;
  const Eigen::Vector3d sight = to_prior.normalized();
  const double shift = range - to_prior.norm();
  FitInput moved = input;
  moved.prior.mean.head<3>() += shift * sight;
  moved.prior.covariance.topLeftCorner<3, 3>() += shift * shift * sight * sight.transpose();
  moved.prior.covariance.block<2, 2>(3, 3) += kTurnSpeed * kTurnSpeed * Eigen::Matrix2d::Identity();
  moved.shape.yaw_variance = TargetShape::kAnyYaw;
  return moved;
}

std::function<bool(const Sides&)> Sensible(const FitInput& input) {
  const auto expected = ProjectTarget(input.camera, input.prior.position(), input.shape);
  const double range = (input.prior.position() - input.camera.p_WC).norm();
  const double share = RangeSigma(input.prior, input.camera) / range;
  if (!expected || share > kKnownShare) return [](const Sides&) { return true; };
  const auto fits = [share, by = HiddenBy(input)](double seen, double wanted) {
    return std::abs(seen - wanted) < by + 3.0 * share * wanted;
  };
  const bool wide = fits(input.detection->box.width, expected->width);
  const bool high = fits(input.detection->box.height, expected->height);
  return [wide, high](const Sides& use) {
    const bool sides = use[kLeft] && use[kRight], caps = use[kTop] && use[kBottom];
    return (sides || !wide) && (caps || !high);
  };
}

}  // namespace chase::perception
