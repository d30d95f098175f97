#include "mapping_metrics.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace chase::mapping::testing {

void HitCounter::Add(const Truth& truth) {
  for (size_t i = 0; i < truth.points.size(); ++i) {
    const auto& p = truth.points[i];
    if (truth.objects[i] == 0 || p.z() < 0.35 || p.z() > 2.9) continue;
    const auto cell = [](double x) { return static_cast<int>(std::floor(x / 0.05)); };
    Entry& entry = entries_[{cell(p.x()), cell(p.y()), cell(p.z())}];
    ++entry.count;
    entry.point = p;
  }
}

double HitCounter::Coverage(const std::vector<world::Obstacle>& obstacles,
                            const Eigen::Vector3d& at, double radius, double t, int* points) const {
  int all = 0, inside = 0;
  for (const auto& [cell, entry] : entries_) {
    if (entry.count < 3 || (entry.point - at).head<2>().norm() > radius) continue;
    ++all;
    inside += Holding(obstacles, entry.point, t) != nullptr;
  }
  if (points) *points = all;
  return all ? static_cast<double>(inside) / all : 1.0;
}

bool Solid(const World& world, const Eigen::Vector3d& p) {
  for (const auto& c : world.cylinders)
    if ((p.head<2>() - c.center).norm() <= c.radius && p.z() >= c.bottom && p.z() <= c.top)
      return true;
  for (const auto& b : world.boxes) {
    const Eigen::Vector3d d = p - b.center;
    const double x = std::cos(b.yaw) * d.x() + std::sin(b.yaw) * d.y();
    const double y = -std::sin(b.yaw) * d.x() + std::cos(b.yaw) * d.y();
    if (std::abs(x) <= b.half.x() && std::abs(y) <= b.half.y() && std::abs(d.z()) <= b.half.z())
      return true;
  }
  return false;
}

double Blocked(const World& world, const std::vector<world::Obstacle>& obstacles,
               const Eigen::Vector2d& low, const Eigen::Vector2d& high, double t) {
  int free = 0, blocked = 0;
  for (double x = low.x(); x <= high.x(); x += 0.1)
    for (double y = low.y(); y <= high.y(); y += 0.1)
      for (double z = 0.5; z <= 2.5; z += 0.5) {
        if (Solid(world, {x, y, z})) continue;
        ++free;
        blocked += Holding(obstacles, {x, y, z}, t) != nullptr;
      }
  return free ? static_cast<double>(blocked) / free : 0.0;
}

double SectionRadius(const world::Obstacle& obstacle, double z) {
  const double dz = z - obstacle.center.coefficients(0, 2);
  const double left = 1.0 - dz * dz * obstacle.shape(2, 2);
  if (left <= 0.0) return 0.0;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(
      Eigen::Matrix2d(obstacle.shape.topLeftCorner<2, 2>()));
  return std::sqrt(left / eigen.eigenvalues()[0]);
}

const world::Obstacle* Holding(const std::vector<world::Obstacle>& obstacles,
                               const Eigen::Vector3d& p, double t) {
  for (const auto& o : obstacles)
    if (!o.ground && o.SquaredDistance(p, t) <= 1.0) return &o;
  return nullptr;
}

}  // namespace chase::mapping::testing
