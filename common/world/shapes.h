#pragma once

#include <Eigen/Core>
#include <vector>

namespace chase::world {

/// A solid of the true world. Frame W, m; `yaw` in rad about z.
struct Solid {
  enum class Kind { kBox, kCylinder, kEllipsoid };  // cylinder: upright
  Kind kind = Kind::kBox;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d half_size = Eigen::Vector3d::Ones();  ///< box: half edges; cylinder: r, r, half
                                                        ///< height; ellipsoid: semi-axes
  double yaw = 0.0;
};

/// Distance from x to the solid's surface, negative inside [m]. Exact for boxes and cylinders, to
/// 1e-9 for ellipsoids.
double SignedDistance(const Solid& solid, const Eigen::Vector3d& x);

/// True when the segment p-q touches the solid.
bool SegmentHits(const Solid& solid, const Eigen::Vector3d& p, const Eigen::Vector3d& q);

}  // namespace chase::world
