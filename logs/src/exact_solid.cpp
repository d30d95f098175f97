#include "logs/src/exact_solid.h"

#include <algorithm>

#include "common/world/forecast.h"

namespace chase::logs::exact {

namespace {

// Rows are the axes of the box, of unit length whatever the quaternion's.
Matrix Axes(const double (&q)[4]) {
  const Rational w = Exact(q[0]), x = Exact(q[1]), y = Exact(q[2]), z = Exact(q[3]);
  const Rational s = w * w + x * x + y * y + z * z;
  Ask(s > 0, "holds axes that are none");
  return {
      {{(w * w + x * x - y * y - z * z) / s, 2 * (x * y + w * z) / s, 2 * (x * z - w * y) / s},
       {2 * (x * y - w * z) / s, (w * w - x * x + y * y - z * z) / s, 2 * (y * z + w * x) / s},
       {2 * (x * z + w * y) / s, 2 * (y * z - w * x) / s, (w * w - x * x - y * y + z * z) / s}}};
}

// The part of x beyond [-half, half].
Rational Beyond(const Rational& x, const Rational& half) {
  return x > half ? Rational(x - half) : x < -half ? Rational(x + half) : Rational(0);
}

// From the foot x of a point z outside: (1 + l R) x = z with x' R x = 1, which falls with l; the
// direction is good to 1e-15.
Vector FromEllipsoid(const Matrix& R, const Vector& z) {
  Rational low = 0, high = 1;
  const auto foot = [&](const Rational& l) {
    Matrix M = R;
    for (size_t a = 0; a < 3; ++a) {
      for (Rational& x : M[a]) x *= l;
      M[a][a] += 1;
    }
    return Times(Inverse(M), z);
  };
  const auto outside = [&](const Vector& x) { return Dot(x, Times(R, x)) > 1; };
  while (outside(foot(high))) high *= 2;
  for (int i = 0; i < 50; ++i) {
    const Rational middle = (low + high) / 2;
    (outside(foot(middle)) ? low : high) = middle;
  }
  return Times(R, foot(high));
}

}  // namespace

Solid SolidOf(const obstacle_t& m, const polynomial_t& way, double flown) {
  Solid s;
  s.kind = m.solid;
  s.ground = m.kind == obstacle_t::GROUND && m.solid == obstacle_t::BOX;
  s.half = ToVector(m.half);
  if (m.solid == obstacle_t::ELLIPSOID) s.inverse = Inverse(s.shape = ToMatrix(m.shape));
  if (m.solid == obstacle_t::BOX) s.axes = Axes(m.orientation);
  for (const Rational& half : s.half) Ask(half >= 0, "has a solid of no size");
  s.covariance = ToMatrix(m.position_covariance);
  s.velocity_covariance = ToMatrix(m.velocity_covariance);
  s.center = Over(m.center, way);
  s.ageing = Exact(way.duration);
  s.age = Seconds(way.utime) - Seconds(m.center.utime);
  const Rational ahead = s.age + Exact(std::min(flown, way.duration));
  const Rational unlisted = ahead - Exact(world::kNoiseListed);
  const bool known = s.covariance == Matrix{} && s.velocity_covariance == Matrix{};
  if (m.kind == obstacle_t::MOVING && !known && unlisted > 0)
    for (size_t a = 0; a < 2; ++a)
      s.velocity_covariance[a][a] += Exact(world::kMoverNoise) / 3 * unlisted;
  return s;
}
Solid SolidOf(const prediction_t& m, const polynomial_t& way) {
  Solid s;
  s.half = {Exact(m.radius), Exact(m.radius), Exact(m.height) / 2};
  s.covariance = ToMatrix(m.covariance);
  s.velocity_covariance = ToMatrix(m.velocity_covariance);
  s.center = Over(m.target, way);
  s.ageing = Exact(way.duration);
  s.age = Seconds(way.utime) - Seconds(m.target.utime);
  return s;
}

Rational Solid::Support(const Vector& n) const {
  if (kind == obstacle_t::ELLIPSOID) return RootAbove(Dot(n, Times(inverse, n)));
  if (kind == obstacle_t::CYLINDER)
    return half[0] * RootAbove(n[0] * n[0] + n[1] * n[1]) + half[2] * abs(n[2]);
  Ask(kind == obstacle_t::BOX, "is about a solid of no kind");
  const Vector along = Times(axes, n);
  return half[0] * abs(along[0]) + half[1] * abs(along[1]) + half[2] * abs(along[2]);
}

Vector Solid::Outwards(const Vector& offset) const {
  if (ground) return axes[2];
  if (kind == obstacle_t::ELLIPSOID) {
    const Vector level = Times(shape, offset);
    return Dot(offset, level) > 1 ? FromEllipsoid(shape, offset) : level;
  }
  const bool box = kind == obstacle_t::BOX;
  Vector x = box ? Times(axes, offset) : offset, scale = {1, 1, 1}, out{};
  if (!box) {  // along x as if the offset were there
    const Rational across = RootAbove(x[0] * x[0] + x[1] * x[1]);
    if (across > 0) scale[0] = x[0] / across, scale[1] = x[1] / across;
    x = {across, 0, x[2]};
  }
  for (size_t a = 0; a < 3; ++a) out[a] = Beyond(x[a], half[a]);
  if (Dot(out, out) == 0) {
    size_t face = 0;
    for (size_t a = 0; a < 3; ++a)
      if ((box || a != 1) && abs(x[a]) - half[a] > abs(x[face]) - half[face]) face = a;
    out[face] = x[face] < 0 ? -1 : 1;
  }
  if (!box) return {out[0] * scale[0], out[0] * scale[1], out[2]};
  Vector n{};
  for (size_t a = 0; a < 3; ++a)
    for (size_t b = 0; b < 3; ++b) n[b] += out[a] * axes[a][b];
  return n;
}

}  // namespace chase::logs::exact
