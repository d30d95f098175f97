#include "common/world/column.h"

#include <algorithm>
#include <cmath>

#include "common/world/separation.h"

namespace chase::world {
namespace {

/// Half the sides of the level box around it, m.
Eigen::Array3d Extent(const Body& body) {
  Eigen::Array3d half;
  for (int a = 0; a < 3; ++a) half[a] = std::abs(SupportPoint(body, Eigen::Vector3d::Unit(a))[a]);
  return half;
}

}  // namespace

bool IsColumnBlocked(const std::vector<Obstacle>& obstacles, const Eigen::Vector3d& p,
                     double radius, double height) {
  Ball climb;
  climb.center.resize(2, 3);
  climb.center << p.transpose(), 0.0, 0.0, height;
  climb.radius = math::Polynomial::Constant(1, radius);
  return std::any_of(obstacles.begin(), obstacles.end(), [&](const Obstacle& o) {
    if (o.ground) return false;
    const Body body = MakeBody(o, o.center.start, 0.0, 0.0);
    const Eigen::Array3d half = Extent(body) + radius;
    const Eigen::Array3d d = p.array() - body.center.row(0).transpose().array();
    const bool beside =
        (d.abs() > half).head<2>().any() || d.z() > half.z() || d.z() + height < -half.z();
    return !beside && Separate(climb, nullptr, body).kept != Kept::kOff;
  });
}

}  // namespace chase::world
