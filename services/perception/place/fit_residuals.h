#pragma once

#include <ceres/jet.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace chase::perception {

// Residuals over y = (p_WT, v_WT, yaw) [m, m/s, rad]; of T = Jet with their derivatives by y.

inline constexpr int kUnknowns = 7, kYawAt = 6;
template <class T>
using Unknown = Eigen::Matrix<T, kUnknowns, 1>;
using Vector7d = Unknown<double>;
using Matrix7d = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Jet = ceres::Jet<double, kUnknowns>;  ///< value `a`, derivatives `v`

inline Unknown<Jet> Jets(const Vector7d& y) {
  Unknown<Jet> jets;
  for (int i = 0; i < kUnknowns; ++i) jets[i] = Jet(y[i], i);
  return jets;
}

/// The target's solid by its size [m]: upright, round or on a square; of a sphere the radius
/// counts.
struct Solid {
  bool square;
  double half, height;
};

/// A line of sight in the plan view: it leaves the camera at c_xy towards the unit vector d_xy and
/// climbs `slope` metres a metre.
struct PlanRay {
  Eigen::Vector3d c;          ///< p_WC, frame W, m
  Eigen::Vector2d direction;  ///< unit, frame W
  double slope = 0.0;

  Eigen::Vector2d Left() const { return {-direction.y(), direction.x()}; }
  template <class T>
  T Along(const Unknown<T>& y) const {
    return direction.x() * (y[0] - c.x()) + direction.y() * (y[1] - c.y());
  }
  /// Positive where the axis stands to the left of the line of sight.
  template <class T>
  T Across(const Unknown<T>& y) const {
    return direction.x() * (y[1] - c.y()) - direction.y() * (y[0] - c.x());
  }
};

/// A horizontal vector in the axes of a base turned by `yaw`.
template <class T, class V>
Eigen::Matrix<T, 2, 1> InBase(const T& yaw, const V& v) {
  using std::cos;
  using std::sin;
  const T c = cos(yaw), s = sin(yaw);
  return {c * v[0] + s * v[1], c * v[1] - s * v[0]};
}

/// How far the base reaches along the unit vector n [m]: its support function.
template <class T>
T Reach(const Solid& solid, const T& yaw, const Eigen::Vector2d& n) {
  using std::abs;
  if (!solid.square) return T(solid.half);
  const auto m = InBase(yaw, n);
  return solid.half * (abs(m[0]) + abs(m[1]));
}

/// Where a line of sight leaves the base (far: +1) or enters it (-1), along it from the foot of the
/// centre [m]. A line that passes beside it, or nearly, counts as the outermost that still crosses
/// it well: beyond, the rim is steep.
template <class T>
T ChordEnd(const PlanRay& ray, const Solid& solid, const Unknown<T>& y, double far) {
  using std::abs;
  using std::max;
  using std::min;
  using std::sqrt;
  constexpr double kMostAcross = 0.975;  // of the reach
  const T most = kMostAcross * Reach(solid, y[kYawAt], ray.Left());
  const T across = min(max(ray.Across(y), T(-most)), most);
  if (!solid.square) return far * sqrt(solid.half * solid.half - across * across);
  const auto d = InBase(y[kYawAt], ray.direction), left = InBase(y[kYawAt], ray.Left());
  const auto face = [&](int i) {  // of the two that lie that way, how far; one may be parallel
    return abs(d[i]) < 1e-9 ? T(1e9) : T(solid.half / abs(d[i]) + far * across * left[i] / d[i]);
  };
  return far * min(face(0), face(1));
}

/// The line of sight touches the side of the target [m]: in the plan view the axis passes it at the
/// base's reach, to the right of a left edge (sign -1), to the left of a right edge (+1).
template <class T>
T SideResidual(const PlanRay& ray, const Solid& solid, double sign, const Unknown<T>& y) {
  return sign * ray.Across(y) - Reach(solid, y[kYawAt], ray.Left());
}

/// The line of sight touches the rim of the top (sign +1) or bottom (-1) [m]. Seen from above, the
/// top's outline is its far rim and the bottom's its near rim; seen from below the other way round.
template <class T>
T CapResidual(const PlanRay& ray, const Solid& solid, double sign, const Unknown<T>& y) {
  const T rim = y[2] + sign * 0.5 * solid.height;
  const double far = (ray.c.z() > rim) == (sign > 0.0) ? 1.0 : -1.0;
  const T along = ray.Along(y) + ChordEnd(ray, solid, y, far);
  return sign * (ray.c.z() + ray.slope * along - rim);
}

/// Root of a sum of squares that has a derivative at 0.
template <class T>
T Length(const T& squares) {
  using std::sqrt;
  return sqrt(squares + 1e-12);
}

/// The line of sight touches a sphere [m]: its centre passes it at one radius, on the inner side of
/// the edge: left or right (`upright`, -1 or +1), bottom or top (-1 or +1).
template <class T>
T TangentResidual(const PlanRay& ray, const Solid& solid, bool upright, double sign,
                  const Unknown<T>& y) {
  const Eigen::Vector3d sight =
      Eigen::Vector3d(ray.direction.x(), ray.direction.y(), ray.slope).normalized();
  const Eigen::Matrix<T, 3, 1> to = y.template head<3>() - ray.c.cast<T>();
  const T along = to[0] * sight.x() + to[1] * sight.y() + to[2] * sight.z();
  const T side = upright ? ray.Across(y) : ray.c.z() + ray.slope * ray.Along(y) - y[2];
  const Eigen::Matrix<T, 3, 1> off = to - along * sight.cast<T>();
  return (sign * side < 0.0 ? -1.0 : 1.0) * Length(T(off.squaredNorm())) - solid.half;
}

/// From the centre of the target where it was `age` s before to a LiDAR point [m].
template <class T>
Eigen::Matrix<T, 3, 1> FromCentre(const Eigen::Vector3d& p_W, double age, const Unknown<T>& y) {
  return p_W.cast<T>() - y.template head<3>() + T(age) * y.template segment<3>(3);
}

/// Signed distance of a LiDAR point [m] from the sphere's surface.
template <class T>
T SpherePointResidual(const Eigen::Vector3d& p_W, double age, const Solid& solid,
                      const Unknown<T>& y) {
  return Length(T(FromCentre(p_W, age, y).squaredNorm())) - solid.half;
}

/// Signed distance from what lies within both of two limits, by the excess over either [m].
template <class T>
T Beyond(const T& a, const T& b) {
  using std::max;
  using std::sqrt;
  return a > 0.0 && b > 0.0 ? sqrt(a * a + b * b) : max(a, b);
}

/// Signed distance of a LiDAR point [m] from the target's surface.
template <class T>
T PointResidual(const Eigen::Vector3d& p_W, double age, const Solid& solid, const Unknown<T>& y) {
  using std::abs;
  const auto q = FromCentre(p_W, age, y);
  const auto m = InBase(y[kYawAt], q);
  const T side = solid.square ? Beyond(T(abs(m[0]) - solid.half), T(abs(m[1]) - solid.half))
                              : Length(T(q[0] * q[0] + q[1] * q[1])) - solid.half;
  return Beyond(side, T(abs(q[2]) - 0.5 * solid.height));
}

}  // namespace chase::perception
