#include "common/world/column.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace chase::world {
namespace {

/// Is the surface of a box or an upright cylinder nearer to x than `radius`, or x inside?
bool IsNear(const Obstacle& o, const Eigen::Vector3d& x, double radius) {
  const Eigen::Vector3d d = x - o.center.Position(o.center.start);
  Eigen::Vector3d beyond;
  if (o.solid == Obstacle::Solid::kBox)
    beyond = (o.axes.conjugate() * d).cwiseAbs() - o.half;
  else
    beyond = {d.head<2>().norm() - o.half.x(), 0.0, std::abs(d.z()) - o.half.z()};
  return beyond.cwiseMax(0.0).norm() < radius;
}

/// Half the sides of the level box around it, m.
Eigen::Array3d Extent(const Obstacle& o) {
  if (o.solid == Obstacle::Solid::kBox) return o.axes.toRotationMatrix().cwiseAbs() * o.half;
  if (o.solid == Obstacle::Solid::kCylinder) return o.half;
  return o.shape.inverse().diagonal().array().sqrt();
}

/// Do the boxes around solid and column overlap?
bool MayReach(const Obstacle& o, const Eigen::Vector3d& p, double radius, double height) {
  const Eigen::Array3d half = Extent(o) + radius;
  const Eigen::Array3d d = p - o.center.Position(o.center.start);
  return std::abs(d.x()) <= half.x() && std::abs(d.y()) <= half.y() && d.z() <= half.z() &&
         d.z() + height >= -half.z();
}

}  // namespace

bool IsColumnBlocked(const std::vector<Obstacle>& obstacles, const Eigen::Vector3d& p,
                     double radius, double height) {
  constexpr double kStep = 0.05;  // m: a sphere of 0.25 m between two places misses 1 mm
  const int steps = static_cast<int>(std::ceil(height / kStep));
  return std::any_of(obstacles.begin(), obstacles.end(), [&](const Obstacle& o) {
    if (o.ground || !MayReach(o, p, radius, height)) return false;
    const bool ellipsoid = o.solid == Obstacle::Solid::kEllipsoid;
    Obstacle grown = o;
    if (ellipsoid) grown.shape = Inflated(o.shape, radius);
    for (int i = 1; i <= steps; ++i) {
      const Eigen::Vector3d x = p + height * i / steps * Eigen::Vector3d::UnitZ();
      if (ellipsoid ? grown.SquaredDistance(x, o.center.start) < 1.0 : IsNear(o, x, radius))
        return true;
    }
    return false;
  });
}

}  // namespace chase::world
