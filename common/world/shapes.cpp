#include "common/world/shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace chase::world {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A range of the segment's parameter; empty when lo > hi.
struct Interval {
  double lo = 0.0, hi = 1.0;
  bool empty() const { return lo > hi; }
};

/// Rotates a vector of frame W into the solid's axes.
Vector3d ToAxes(const Solid& solid, const Vector3d& v) {
  const double c = std::cos(solid.yaw), s = std::sin(solid.yaw);
  return {c * v.x() + s * v.y(), -s * v.x() + c * v.y(), v.z()};
}

double BoxDistance(const Vector3d& half, const Vector3d& x) {
  const Vector3d q = x.cwiseAbs() - half;
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}

double CylinderDistance(const Vector3d& half, const Vector3d& x) {
  const Vector2d q(x.head<2>().norm() - half.x(), std::abs(x.z()) - half.z());
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}

/// The multiplier t of the closest point x_i = e_i^2 y_i / (t + e_i^2): the largest root of
/// F(t) = sum (e_i y_i / (t + e_i^2))^2 - 1, or the pole -min(e)^2 when F is negative there.
/// Newton's method from the left: F is convex and falls, so the iterates only grow.
double ClosestMultiplier(const Vector3d& e, const Vector3d& y) {
  const double pole = -e.cwiseAbs2().minCoeff();
  double t = std::max(pole, (e.cwiseProduct(y) - e.cwiseAbs2()).maxCoeff());
  for (int i = 0; i < 100; ++i) {
    double f = -1.0, slope = 0.0;
    for (int k = 0; k < 3; ++k) {
      const double s = t + e[k] * e[k];
      if (y[k] == 0.0 || s <= 0.0) continue;
      const double w = e[k] * y[k] / s;
      f += w * w;
      slope -= 2.0 * w * w / s;
    }
    if (f <= 0.0 || slope == 0.0) break;
    const double next = t - f / slope;
    if (next <= t) break;
    t = next;
  }
  return t;
}

/// Closest surface point after Eberly, "Distance from a Point to an Ellipse, an Ellipsoid", with
/// the degenerate case (the point on a plane of symmetry, near the centre) taken at the pole.
double EllipsoidDistance(const Vector3d& e, const Vector3d& point) {
  const Vector3d y = point.cwiseAbs();
  const double t = ClosestMultiplier(e, y);
  int smallest = 0;
  e.minCoeff(&smallest);
  Vector3d x = Vector3d::Zero();
  double rest = 1.0;
  for (int k = 0; k < 3; ++k) {
    const double s = t + e[k] * e[k];
    if (y[k] > 0.0 && s > 0.0) x[k] = e[k] * e[k] * y[k] / s;
    rest -= x[k] * x[k] / (e[k] * e[k]);
  }
  if (t + e[smallest] * e[smallest] <= 0.0)
    x[smallest] = e[smallest] * std::sqrt(std::max(0.0, rest));
  const double inside = y.cwiseQuotient(e).squaredNorm() < 1.0 ? -1.0 : 1.0;
  return inside * (x - y).norm();
}

/// The part of `in` where |p + s d| <= half.
Interval ClipSlab(Interval in, double p, double d, double half) {
  if (d == 0.0) return std::abs(p) <= half ? in : Interval{1.0, 0.0};
  const double a = (-half - p) / d, b = (half - p) / d;
  return {std::max(in.lo, std::min(a, b)), std::min(in.hi, std::max(a, b))};
}

/// The part of `in` where the quadratic a s^2 + 2 b s + c <= 0, a >= 0.
Interval ClipQuadratic(Interval in, double a, double b, double c) {
  if (a == 0.0) return c <= 0.0 ? in : Interval{1.0, 0.0};
  const double discriminant = b * b - a * c;
  if (discriminant < 0.0) return {1.0, 0.0};
  const double root = std::sqrt(discriminant);
  return {std::max(in.lo, (-b - root) / a), std::min(in.hi, (-b + root) / a)};
}

}  // namespace

double SignedDistance(const Solid& solid, const Vector3d& x) {
  const Vector3d local = ToAxes(solid, x - solid.center);
  switch (solid.kind) {
    case Solid::Kind::kBox:
      return BoxDistance(solid.half_size, local);
    case Solid::Kind::kCylinder:
      return CylinderDistance(solid.half_size, local);
    case Solid::Kind::kEllipsoid:
      return EllipsoidDistance(solid.half_size, local);
  }
  return std::numeric_limits<double>::infinity();
}

bool SegmentHits(const Solid& solid, const Vector3d& p, const Vector3d& q) {
  const Vector3d& half = solid.half_size;
  Vector3d a = ToAxes(solid, p - solid.center), d = ToAxes(solid, q - p);
  Interval s;
  if (solid.kind == Solid::Kind::kBox) {
    for (int k = 0; k < 3; ++k) s = ClipSlab(s, a[k], d[k], half[k]);
    return !s.empty();
  }
  if (solid.kind == Solid::Kind::kCylinder) {
    s = ClipSlab(s, a.z(), d.z(), half.z());
    a.z() = d.z() = 0.0;
    a /= half.x();
    d /= half.x();
  } else {
    a = a.cwiseQuotient(half).eval();
    d = d.cwiseQuotient(half).eval();
  }
  return !ClipQuadratic(s, d.squaredNorm(), a.dot(d), a.squaredNorm() - 1.0).empty();
}

}  // namespace chase::world
