#include "common/math/simplex.h"

#include <Eigen/Geometry>
#include <cmath>

namespace chase::math {
namespace {

using Eigen::Vector3d;

// Edges whose volume (area) is this small against their lengths span no simplex.
constexpr double kFlat = 1e-12;

}  // namespace

bool Simplex::AffineWeights(double* w) const {
  const Vector3d o = points_.col(0);
  w[0] = 1.0;
  if (size_ == 1) return true;
  const Vector3d a = points_.col(1) - o;
  if (size_ == 2) {
    const double aa = a.squaredNorm();
    if (!(aa > 0.0)) return false;
    w[1] = -o.dot(a) / aa;
    w[0] -= w[1];
    return true;
  }
  const Vector3d b = points_.col(2) - o, ab = a.cross(b);
  if (size_ == 3) {
    const double area = ab.squaredNorm();
    if (!(area > kFlat * kFlat * a.squaredNorm() * b.squaredNorm())) return false;
    w[1] = -o.cross(b).dot(ab) / area;
    w[2] = -a.cross(o).dot(ab) / area;
    w[0] -= w[1] + w[2];
    return true;
  }
  const Vector3d c = points_.col(3) - o;
  const double volume = ab.dot(c);
  if (!(std::abs(volume) > kFlat * a.norm() * b.norm() * c.norm())) return false;
  w[1] = -o.dot(b.cross(c)) / volume;
  w[2] = -o.dot(c.cross(a)) / volume;
  w[3] = -o.dot(ab) / volume;
  w[0] -= w[1] + w[2] + w[3];
  return true;
}

// From the current weights towards those of the affine hull until one reaches zero: its point goes,
// and again.
bool Simplex::Reduce() {
  for (;;) {
    double wanted[4];
    if (!AffineWeights(wanted)) return false;
    double step = 1.0;
    int first = -1;
    for (int i = 0; i < size_; ++i) {
      if (wanted[i] >= 0.0) continue;
      const double to_zero = weights_[i] / (weights_[i] - wanted[i]);
      if (first >= 0 && to_zero >= step) continue;
      step = to_zero;
      first = i;
    }
    for (int i = 0; i < size_; ++i) weights_[i] += step * (wanted[i] - weights_[i]);
    if (first < 0) return true;
    --size_;
    for (int i = first; i < size_; ++i) {
      points_.col(i) = points_.col(i + 1);
      weights_[i] = weights_[i + 1];
    }
  }
}

bool Simplex::Add(const Vector3d& point) {
  if (size_ == 4) return false;  // the origin is inside
  const Simplex before = *this;
  points_.col(size_) = point;
  weights_[size_] = size_ == 0 ? 1.0 : 0.0;
  ++size_;
  const bool reduced = Reduce();
  Vector3d nearest = Vector3d::Zero();
  for (int i = 0; i < size_; ++i) nearest += weights_[i] * points_.col(i);
  const bool nearer = before.size_ == 0 || nearest.squaredNorm() < nearest_.squaredNorm();
  if (!reduced || !nearer) {
    *this = before;
    return false;
  }
  nearest_ = nearest;
  return true;
}

}  // namespace chase::math
