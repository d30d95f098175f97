#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace chase::perception {

// Residuals over y = (p_WT, v_WT, radius, height) [m, m/s, m, m], and their derivatives by y where
// `gradient` is not null.

using Vector8d = Eigen::Matrix<double, 8, 1>;

/// A line of sight in the plan view: it leaves the camera at c_xy towards the unit vector d_xy and
/// climbs `slope` metres a metre.
struct PlanRay {
  Eigen::Vector3d c;          ///< p_WC, frame W, m
  Eigen::Vector2d direction;  ///< unit, frame W
  double slope = 0.0;

  double Along(const Vector8d& y) const { return direction.dot(y.head<2>() - c.head<2>()); }
  /// Positive where the axis stands to the left of the line of sight.
  double Across(const Vector8d& y) const {
    return direction.x() * (y[1] - c.y()) - direction.y() * (y[0] - c.x());
  }
  Eigen::Vector2d AcrossGradient() const { return {-direction.y(), direction.x()}; }
};

/// The line of sight touches the side of the cylinder: in the plan view the axis passes it at one
/// radius, to the right of a left edge, to the left of a right edge.
struct SideResidual {
  PlanRay ray;
  double sign;   ///< +1: right edge, -1: left edge
  double scale;  ///< 1/m

  double operator()(const Vector8d& y, Vector8d* gradient) const {
    if (gradient)
      *gradient << scale * sign * ray.AcrossGradient(), Eigen::Vector4d::Zero(), -scale, 0.0;
    return scale * (sign * ray.Across(y) - y[6]);
  }
};

/// The line of sight touches the rim of the top or bottom. Seen from above, the top's outline is
/// its far rim and the bottom's its near rim; seen from below the other way round.
struct CapResidual {
  static constexpr double kLeastChord = 0.05;  ///< squared, in radii: beside it the rim is steep

  PlanRay ray;
  double sign;   ///< +1: top edge, -1: bottom edge
  double scale;  ///< 1/m

  double operator()(const Vector8d& y, Vector8d* gradient) const {
    const double across = ray.Across(y), radius = y[6];
    const double rim = y[2] + sign * 0.5 * y[7];
    const double inside = radius * radius - across * across;
    const bool crosses = inside > kLeastChord * radius * radius;
    const double chord = crosses ? std::sqrt(inside) : std::sqrt(kLeastChord) * radius;
    const double far = (ray.c.z() > rim) == (sign > 0.0) ? 1.0 : -1.0;
    if (gradient) {
      const double by_across = crosses ? -across / chord : 0.0;
      const double by_radius = crosses ? radius / chord : std::sqrt(kLeastChord);
      const Eigen::Vector2d reach = ray.direction + far * by_across * ray.AcrossGradient();
      *gradient << ray.slope * reach, -1.0, Eigen::Vector3d::Zero(), ray.slope * far * by_radius,
          -0.5 * sign;
      *gradient *= scale * sign;
    }
    return scale * sign * (ray.c.z() + ray.slope * (ray.Along(y) + far * chord) - rim);
  }
};

/// The line of sight touches a sphere: its centre passes it at one radius, on the inner side of the
/// edge.
struct TangentResidual {
  PlanRay ray;
  bool upright;  ///< a left or right edge
  double sign;   ///< +1: right or top edge, -1: left or bottom edge
  double scale;  ///< 1/m

  double operator()(const Vector8d& y, Vector8d* gradient) const {
    const Eigen::Vector3d sight =
        Eigen::Vector3d(ray.direction.x(), ray.direction.y(), ray.slope).normalized();
    const Eigen::Vector3d to_center = y.head<3>() - ray.c;
    const Eigen::Vector3d off = to_center - to_center.dot(sight) * sight;
    const double side = upright ? ray.Across(y) : ray.c.z() + ray.slope * ray.Along(y) - y[2];
    const double inner = sign * side < 0.0 ? -1.0 : 1.0;
    const double distance = std::sqrt(off.squaredNorm() + 1e-12);
    if (gradient) *gradient << scale * inner / distance * off, Eigen::Vector3d::Zero(), -scale, 0.0;
    return scale * (inner * distance - y[6]);
  }
};

/// Distance of a LiDAR point from the surface of a sphere where it was at the point's time.
struct SpherePointResidual {
  Eigen::Vector3d p_W;
  double age;    ///< s
  double scale;  ///< 1/m

  double operator()(const Vector8d& y, Vector8d* gradient) const {
    const Eigen::Vector3d q = p_W - (y.head<3>() - age * y.segment<3>(3));
    const double distance = std::sqrt(q.squaredNorm() + 1e-12);
    if (gradient) *gradient << -q / distance, age * q / distance, -1.0, 0.0;
    if (gradient) *gradient *= scale;
    return scale * (distance - y[6]);
  }
};

/// Distance of a LiDAR point from the surface of the cylinder where it stood at the point's time.
struct PointResidual {
  Eigen::Vector3d p_W;
  double age;    ///< s
  double scale;  ///< 1/m

  double operator()(const Vector8d& y, Vector8d* gradient) const {
    const Eigen::Vector3d q = p_W - (y.head<3>() - age * y.segment<3>(3));
    const double from_axis = std::sqrt(q.head<2>().squaredNorm() + 1e-12);
    const double side = from_axis - y[6], cap = std::abs(q.z()) - 0.5 * y[7];
    const bool corner = side > 0.0 && cap > 0.0;
    const double distance = corner ? std::sqrt(side * side + cap * cap) : std::max(side, cap);
    if (gradient) {
      const double by_side = corner ? side / distance : side > cap ? 1.0 : 0.0;
      const double by_cap = corner ? cap / distance : side > cap ? 0.0 : 1.0;
      Eigen::Vector3d by_q;
      by_q << by_side / from_axis * q.head<2>(), by_cap * (q.z() < 0.0 ? -1.0 : 1.0);
      *gradient << -by_q, age * by_q, -by_side, -0.5 * by_cap;
      *gradient *= scale;
    }
    return scale * distance;
  }
};

}  // namespace chase::perception
