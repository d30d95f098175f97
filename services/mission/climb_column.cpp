#include "services/mission/climb_column.h"

#include <algorithm>
#include <cmath>

namespace chase::mission {
namespace {

/// Is the surface of a box or an upright cylinder nearer to x than `radius`, or x inside?
bool IsNear(const world::Obstacle& o, const Eigen::Vector3d& x, double radius) {
  const Eigen::Vector3d d = x - o.center.Position(o.center.start);
  Eigen::Vector3d beyond;
  if (o.solid == world::Obstacle::Solid::kBox)
    beyond = (o.axes.conjugate() * d).cwiseAbs() - o.half;
  else
    beyond = {d.head<2>().norm() - o.half.x(), 0.0, std::abs(d.z()) - o.half.z()};
  return beyond.cwiseMax(0.0).norm() < radius;
}

}  // namespace

bool IsBlocked(const std::vector<world::Obstacle>& obstacles, const Eigen::Vector3d& p,
               double radius, double height) {
  constexpr double kStep = 0.05;  // m: a sphere of 0.25 m between two places misses 1 mm
  const int steps = static_cast<int>(std::ceil(height / kStep));
  return std::any_of(obstacles.begin(), obstacles.end(), [&](const world::Obstacle& o) {
    if (o.ground) return false;
    const bool ellipsoid = o.solid == world::Obstacle::Solid::kEllipsoid;
    world::Obstacle grown = o;
    if (ellipsoid) grown.shape = world::Inflated(o.shape, radius);
    for (int i = 1; i <= steps; ++i) {
      const Eigen::Vector3d x = p + height * i / steps * Eigen::Vector3d::UnitZ();
      if (ellipsoid ? grown.SquaredDistance(x, o.center.start) < 1.0 : IsNear(o, x, radius))
        return true;
    }
    return false;
  });
}

}  // namespace chase::mission
