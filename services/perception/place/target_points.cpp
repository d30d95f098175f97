#include "services/perception/place/target_points.h"

#include <algorithm>
#include <cmath>

#include "services/perception/place/fit_problem.h"

namespace chase::perception {

namespace {

constexpr size_t kMinPoints = 3;    // of a cluster that gives a range
constexpr size_t kMostPoints = 40;  // in a fit
constexpr double kMostOfIt = 0.8;   // share of the target that a ray goes through
constexpr double kBehind = 0.25;    // m behind the target where such a ray ends at least

/// True when the lidar looked well through the target, and hit something behind it.
bool SawThrough(const TargetPoint& point, const TargetShape& shape, const TargetGaussian& target,
                double range_sigma) {
  const Eigen::Vector3d center = target.position() - point.age * target.velocity();
  const Eigen::Vector3d ray = point.p_W - point.p_WL, to_center = center - point.p_WL;
  const double length = std::max(1e-6, ray.head<2>().norm());
  const double along = ray.head<2>().dot(to_center.head<2>()) / length;
  const double beside = std::abs(ray.x() * to_center.y() - ray.y() * to_center.x()) / length;
  const double above = point.p_WL.z() + along / length * ray.z() - center.z();
  return beside < kMostOfIt * shape.size[0] && std::abs(above) < kMostOfIt * 0.5 * shape.size[1] &&
         length > along + shape.MostHalfWidth() + kBehind + 2.0 * range_sigma;
}

}  // namespace

double RangeSigma(const TargetGaussian& target, const Camera& camera) {
  const Eigen::Vector3d sight = (target.position() - camera.p_WC).normalized();
  return std::sqrt(sight.dot(target.covariance.topLeftCorner<3, 3>() * sight));
}

std::vector<TargetPoint> PointsOnTarget(const FitInput& input,
                                        const std::vector<TargetPoint>& cluster, double gate) {
  const Vector7d y = Unknowns(input.prior, input.shape);
  std::vector<TargetPoint> kept;
  for (const auto& p : cluster)
    if (std::abs(SurfaceDistance(input.shape, p, y)) < gate) kept.push_back(p);
  if (!GivesRange(kept)) return {};
  const size_t step = 1 + kept.size() / kMostPoints;  // more would not tell more
  std::vector<TargetPoint> some;
  for (size_t i = 0; i < kept.size(); i += step) some.push_back(kept[i]);
  return some;
}

int RaysThrough(const FitInput& input, const TargetGaussian& target) {
  const double sigma = RangeSigma(target, input.camera);
  int count = 0;
  for (size_t i = 0; input.hits && i < input.hits->size(); ++i)
    for (const auto& p : (*input.hits)[i]) count += SawThrough(p, input.shape, target, sigma);
  return count;
}

double MedianRange(const std::vector<TargetPoint>& cluster) {
  return cluster[cluster.size() / 2].range;
}

bool GivesRange(const std::vector<TargetPoint>& cluster) { return cluster.size() >= kMinPoints; }

}  // namespace chase::perception
