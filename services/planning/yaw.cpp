#include "services/planning/yaw.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/math/rotation.h"
#include "services/planning/problem.h"

namespace chase::planning {
namespace {

constexpr int kSamples = 25;
constexpr int kDegree = 6;
constexpr double kTooNear = 0.15;  // m; nearer than this the bearing is not followed

using Samples = Eigen::Matrix<double, kSamples, 1>;
using Fit = Eigen::Matrix<double, Eigen::Dynamic, kSamples, 0, kDegree, kSamples>;

// Least squares for the powers from `first` on, from samples at equal spacing in tau. A little
// damping: the power basis is ill-conditioned and the bearing may be a staircase.
Fit MakeFit(int first) {
  const int n = kDegree + 1 - first;
  Eigen::MatrixXd basis(kSamples, n);
  for (int i = 0; i < kSamples; ++i)
    for (int k = 0; k < n; ++k)
      basis(i, k) = std::pow(static_cast<double>(i) / (kSamples - 1), first + k);
  const Eigen::MatrixXd normal = basis.transpose() * basis + 1e-6 * Eigen::MatrixXd::Identity(n, n);
  return normal.ldlt().solve(basis.transpose());
}

const Fit& FitFrom(int first) {
  static const Fit from_second = MakeFit(1), from_third = MakeFit(2);
  return first == 1 ? from_second : from_third;
}

// Horizontal parts of target - plan over the plan's tau.
using Level = Eigen::Matrix<double, Eigen::Dynamic, 2, 0, 16, 2>;
Level Relative(const world::Trajectory& plan, const world::Trajectory& target) {
  const Curve theirs = ToCurve(target, plan.start, plan.duration);
  Level r = Level::Zero(std::max(theirs.rows(), plan.coefficients.rows()), 2);
  r.topRows(theirs.rows()) = theirs.leftCols<2>();
  r.topRows(plan.coefficients.rows()) -= plan.coefficients.leftCols<2>();
  return r;
}

double ShortestTurn(double angle) {
  return std::abs(angle) < M_PI ? angle : math::WrapAngle(angle);
}

// Bearings at equal spacing, limited to what `max_rate` can follow from `start`.
Samples FollowedBearings(const world::Trajectory& plan, const world::Trajectory& target,
                         const std::optional<YawStart>& start, double max_rate) {
  Samples samples;
  const Level r = Relative(plan, target);
  const double step = plan.duration / (kSamples - 1);
  double yaw = start ? start->yaw : 0.0;
  bool known = start.has_value();
  for (int i = 0; i < kSamples; ++i) {
    const double tau = static_cast<double>(i) / (kSamples - 1);
    double x = 0.0, y = 0.0;
    for (Eigen::Index k = r.rows() - 1; k >= 0; --k) {
      x = x * tau + r(k, 0);
      y = y * tau + r(k, 1);
    }
    if (x * x + y * y > kTooNear * kTooNear) {
      const double bearing = std::atan2(y, x);
      const double reach = i == 0 ? 0.0 : max_rate * step;
      yaw = known ? yaw + std::clamp(ShortestTurn(bearing - yaw), -reach, reach) : bearing;
      known = true;
    }
    samples[i] = yaw;
  }
  return samples;
}

}  // namespace

std::vector<double> FitYaw(const world::Trajectory& plan, const world::Trajectory& target,
                           const std::optional<YawStart>& start, double max_rate) {
  Samples samples = FollowedBearings(plan, target, start, max_rate);
  std::vector<double> yaw(kDegree + 1, 0.0);
  yaw[0] = samples[0];
  const int first = start ? 2 : 1;
  if (start) yaw[1] = std::clamp(start->rate, -max_rate, max_rate) * plan.duration;
  for (int i = 0; i < kSamples; ++i)
    samples[i] -= yaw[0] + yaw[1] * static_cast<double>(i) / (kSamples - 1);
  const Fit& fit = FitFrom(first);
  for (Eigen::Index k = 0; k < fit.rows(); ++k) {
    const double c = fit.row(k).dot(samples);
    yaw[static_cast<size_t>(first + k)] = std::isfinite(c) ? c : 0.0;
  }
  return yaw;
}

std::vector<double> TurningYaw(const YawStart& start, double duration) {
  return {start.yaw, start.rate * duration};
}

double EvaluateYaw(const std::vector<double>& yaw, double tau) {
  double value = 0.0;
  for (size_t k = yaw.size(); k-- > 0;) value = value * tau + yaw[k];
  return value;
}

YawStart YawAt(const std::vector<double>& yaw, double tau, double duration) {
  double rate = 0.0;
  for (size_t k = yaw.size(); k-- > 1;) rate = rate * tau + static_cast<double>(k) * yaw[k];
  return {EvaluateYaw(yaw, tau), rate / duration};
}

}  // namespace chase::planning
