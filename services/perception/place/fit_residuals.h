#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "services/perception/place/footprint.h"

namespace chase::perception {

// Residuals over y = (p_WT, v_WT, yaw, half width, height) [m, m/s, rad, m, m], and their
// derivatives by y where `gradient` is not null. Half the width of a cylinder or sphere is its
// radius.

using Vector9d = Eigen::Matrix<double, 9, 1>;
inline constexpr int kYawAt = 6, kHalfWidthAt = 7, kHeightAt = 8;  ///< in y

/// A line of sight in the plan view: it leaves the camera at c_xy towards the unit vector d_xy and
/// climbs `slope` metres a metre.
struct PlanRay {
  Eigen::Vector3d c;          ///< p_WC, frame W, m
  Eigen::Vector2d direction;  ///< unit, frame W
  double slope = 0.0;

  double Along(const Vector9d& y) const { return direction.dot(y.head<2>() - c.head<2>()); }
  /// Positive where the axis stands to the left of the line of sight.
  double Across(const Vector9d& y) const {
    return direction.x() * (y[1] - c.y()) - direction.y() * (y[0] - c.x());
  }
  Eigen::Vector2d AcrossGradient() const { return {-direction.y(), direction.x()}; }
};

inline Footprint FootprintOf(bool square, const Vector9d& y) {
  return {square, y[kHalfWidthAt], y[kYawAt]};
}

/// The line of sight touches the side of the target: in the plan view the axis passes it at the
/// footprint's reach, to the right of a left edge, to the left of a right edge.
struct SideResidual {
  PlanRay ray;
  bool square;
  double sign;   ///< +1: right edge, -1: left edge
  double scale;  ///< 1/m

  double operator()(const Vector9d& y, Vector9d* gradient) const {
    const Eigen::Vector2d left = ray.AcrossGradient();
    const PlanLength reach = FootprintOf(square, y).Reach(left);
    if (gradient) {
      *gradient << sign * left, Eigen::Vector4d::Zero(), -reach.by_yaw, -reach.by_half, 0.0;
      *gradient *= scale;
    }
    return scale * (sign * ray.Across(y) - reach.value);
  }
};

/// The line of sight touches the rim of the top or bottom. Seen from above, the top's outline is
/// its far rim and the bottom's its near rim; seen from below the other way round.
struct CapResidual {
  PlanRay ray;
  bool square;
  double sign;   ///< +1: top edge, -1: bottom edge
  double scale;  ///< 1/m

  double operator()(const Vector9d& y, Vector9d* gradient) const {
    const double rim = y[2] + sign * 0.5 * y[kHeightAt];
    const double far = (ray.c.z() > rim) == (sign > 0.0) ? 1.0 : -1.0;
    const PlanLength end = FootprintOf(square, y).Chord(ray.direction, ray.Across(y), far);
    if (gradient) {
      const Eigen::Vector2d reach = ray.direction + end.by_place * ray.AcrossGradient();
      *gradient << ray.slope * reach, -1.0, Eigen::Vector3d::Zero(), ray.slope * end.by_yaw,
          ray.slope * end.by_half, -0.5 * sign;
      *gradient *= scale * sign;
    }
    return scale * sign * (ray.c.z() + ray.slope * (ray.Along(y) + end.value) - rim);
  }
};

/// The line of sight touches a sphere: its centre passes it at one radius, on the inner side of the
/// edge.
struct TangentResidual {
  PlanRay ray;
  bool upright;  ///< a left or right edge
  double sign;   ///< +1: right or top edge, -1: left or bottom edge
  double scale;  ///< 1/m

  double operator()(const Vector9d& y, Vector9d* gradient) const {
    const Eigen::Vector3d sight =
        Eigen::Vector3d(ray.direction.x(), ray.direction.y(), ray.slope).normalized();
    const Eigen::Vector3d to_center = y.head<3>() - ray.c;
    const Eigen::Vector3d off = to_center - to_center.dot(sight) * sight;
    const double side = upright ? ray.Across(y) : ray.c.z() + ray.slope * ray.Along(y) - y[2];
    const double inner = sign * side < 0.0 ? -1.0 : 1.0;
    const double distance = std::sqrt(off.squaredNorm() + 1e-12);
    if (gradient) *gradient << scale * inner / distance * off, Eigen::Vector4d::Zero(), -scale, 0.0;
    return scale * (inner * distance - y[kHalfWidthAt]);
  }
};

/// Distance of a LiDAR point from the surface of a sphere where it was at the point's time.
struct SpherePointResidual {
  Eigen::Vector3d p_W;
  double age;    ///< s
  double scale;  ///< 1/m

  double operator()(const Vector9d& y, Vector9d* gradient) const {
    const Eigen::Vector3d q = p_W - (y.head<3>() - age * y.segment<3>(3));
    const double distance = std::sqrt(q.squaredNorm() + 1e-12);
    if (gradient) *gradient << -q / distance, age * q / distance, 0.0, -1.0, 0.0;
    if (gradient) *gradient *= scale;
    return scale * (distance - y[kHalfWidthAt]);
  }
};

/// Distance of a LiDAR point from the surface of the target where it stood at the point's time.
struct PointResidual {
  Eigen::Vector3d p_W;
  bool square;
  double age;    ///< s
  double scale;  ///< 1/m

  double operator()(const Vector9d& y, Vector9d* gradient) const {
    const Eigen::Vector3d q = p_W - (y.head<3>() - age * y.segment<3>(3));
    Eigen::Vector2d by_place;
    const PlanLength side = FootprintOf(square, y).Distance(q.head<2>(), &by_place);
    const double cap = std::abs(q.z()) - 0.5 * y[kHeightAt];
    const bool corner = side.value > 0.0 && cap > 0.0;
    const double distance =
        corner ? std::sqrt(side.value * side.value + cap * cap) : std::max(side.value, cap);
    if (gradient) {
      const double by_side = corner ? side.value / distance : side.value > cap ? 1.0 : 0.0;
      const double by_cap = corner ? cap / distance : side.value > cap ? 0.0 : 1.0;
      Eigen::Vector3d by_q;
      by_q << by_side * by_place, by_cap * (q.z() < 0.0 ? -1.0 : 1.0);
      *gradient << -by_q, age * by_q, by_side * side.by_yaw, by_side * side.by_half, -0.5 * by_cap;
      *gradient *= scale;
    }
    return scale * distance;
  }
};

}  // namespace chase::perception
