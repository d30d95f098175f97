#include "services/planning/yaw.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/math/rotation.h"

namespace chase::planning {
namespace {

constexpr int kSamples = 25;
constexpr int kDegree = 6;
constexpr double kTooNear = 0.15;  // m; nearer than this the bearing is not followed

using Samples = Eigen::Matrix<double, kSamples, 1>;

// Bearings at equal spacing, limited to what `max_rate` can follow from `start`.
Samples FollowedBearings(const world::Trajectory& plan, const world::Trajectory& target,
                         const std::optional<YawStart>& start, double max_rate) {
  Samples samples;
  const double step = plan.duration / (kSamples - 1);
  double yaw = start ? start->yaw : 0.0;
  bool known = start.has_value();
  for (int i = 0; i < kSamples; ++i) {
    const double t = plan.start + i * step;
    const Eigen::Vector3d r = target.Position(t) - plan.Position(t);
    if (r.head<2>().norm() > kTooNear) {
      const double bearing = std::atan2(r.y(), r.x());
      const double reach = i == 0 ? 0.0 : max_rate * step;
      yaw = known ? yaw + std::clamp(math::WrapAngle(bearing - yaw), -reach, reach) : bearing;
      known = true;
    }
    samples[i] = yaw;
  }
  return samples;
}

}  // namespace

std::vector<double> FitYaw(const world::Trajectory& plan, const world::Trajectory& target,
                           const std::optional<YawStart>& start, double max_rate) {
  const Samples samples = FollowedBearings(plan, target, start, max_rate);
  std::vector<double> yaw(kDegree + 1, 0.0);
  yaw[0] = samples[0];
  const int first = start ? 2 : 1;
  if (start) yaw[1] = std::clamp(start->rate, -max_rate, max_rate) * plan.duration;
  const int n = kDegree + 1 - first;
  Eigen::MatrixXd basis(kSamples, n);
  Samples rest;
  for (int i = 0; i < kSamples; ++i) {
    const double tau = static_cast<double>(i) / (kSamples - 1);
    rest[i] = samples[i] - yaw[0] - yaw[1] * tau;
    for (int k = 0; k < n; ++k) basis(i, k) = std::pow(tau, first + k);
  }
  // A little damping: the power basis is ill-conditioned and the bearing may be a staircase.
  const Eigen::MatrixXd normal = basis.transpose() * basis + 1e-6 * Eigen::MatrixXd::Identity(n, n);
  const Eigen::VectorXd fit = normal.ldlt().solve(basis.transpose() * rest);
  for (int k = 0; k < n; ++k)
    yaw[static_cast<size_t>(first + k)] = std::isfinite(fit[k]) ? fit[k] : 0.0;
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
