#include "services/perception/readings.h"

#include <cmath>

#include "services/perception/target_points.h"

namespace chase::perception {

namespace {

constexpr double kTurnSpeed = 1.0;    // m/s, standard deviation of the speed a sharp turn adds
constexpr double kTurnShift = 0.12;   // m, and of the place
constexpr double kKnownShare = 0.03;  // of the range, standard deviation of the prediction
constexpr double kKnownRange = 0.25;  // m, likewise

}  // namespace

bool RangeIsKnown(const FitInput& input) {
  return !input.points.empty() || RangeSigma(input) < kKnownRange;
}

FitInput AfterASharpTurn(const FitInput& input) {
  Eigen::Vector2d sight = (input.prior.position() - input.camera.p_WC).head<2>().normalized();
  Eigen::Matrix2d across = Eigen::Matrix2d::Identity();
  if (input.points.empty()) across -= sight * sight.transpose();
  FitInput turned = input;
  turned.prior.covariance.topLeftCorner<2, 2>() += kTurnShift * kTurnShift * across;
  turned.prior.covariance.block<2, 2>(3, 3) += kTurnSpeed * kTurnSpeed * across;
  turned.shape.yaw_variance = TargetShape::kAnyYaw;
  return turned;
}

std::function<bool(const Sides&)> Sensible(const FitInput& input) {
  const auto expected = ProjectTarget(input.camera, input.prior.position(), input.shape);
  const double range = (input.prior.position() - input.camera.p_WC).norm();
  if (!expected || RangeSigma(input) > kKnownShare * range)
    return [](const Sides&) { return true; };
  const double share = RangeSigma(input) / range;
  const auto fits = [share](double seen, double wanted) {
    return std::abs(seen - wanted) < kHiddenBy + 3.0 * share * wanted;
  };
  const bool wide = fits(input.detection->box.width, expected->width);
  const bool high = fits(input.detection->box.height, expected->height);
  return [wide, high](const Sides& use) {
    const bool sides = use[kLeft] && use[kRight], caps = use[kTop] && use[kBottom];
    return (sides || !wide) && (caps || !high);
  };
}

}  // namespace chase::perception
