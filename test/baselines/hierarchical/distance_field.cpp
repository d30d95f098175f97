#include "test/baselines/hierarchical/distance_field.h"

#include <algorithm>
#include <cmath>

namespace chase::baselines {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<Vector3d> Circles(const std::vector<world::Obstacle>& obstacles) {
  std::vector<Vector3d> circles;
  for (const world::Obstacle& o : obstacles) {
    const Vector3d c = o.center.coefficients.row(0).transpose();
    circles.emplace_back(c.x(), c.y(), 1.0 / std::sqrt(o.shape(0, 0)));
  }
  return circles;
}

}  // namespace

DistanceField::DistanceField(const std::vector<world::Obstacle>& obstacles, double cell, double cut)
    : cell_(cell), cut_(cut), circles_(Circles(obstacles)) {
  if (circles_.empty()) return;
  Vector2d low = circles_[0].head<2>(), high = low;
  double widest = 0.0;
  for (const Vector3d& c : circles_) {
    low = low.cwiseMin(c.head<2>());
    high = high.cwiseMax(c.head<2>());
    widest = std::max(widest, c.z());
  }
  const double edge = widest + cut + cell;
  origin_ = low.array() - edge;
  const Vector2d size = (high - low).array() + 2.0 * edge;
  nx_ = static_cast<int>(std::ceil(size.x() / cell)) + 1;
  ny_ = static_cast<int>(std::ceil(size.y() / cell)) + 1;
  value_.assign(static_cast<size_t>(nx_) * static_cast<size_t>(ny_), cut);
  for (const Vector3d& c : circles_) {  // only the neighbourhood that the cut leaves
    const double reach = c.z() + cut;
    const auto first = [&](int axis) {
      return std::max(0, static_cast<int>((c[axis] - reach - origin_[axis]) / cell));
    };
    const auto last = [&](int axis, int n) {
      return std::min(n - 1, static_cast<int>((c[axis] + reach - origin_[axis]) / cell) + 1);
    };
    for (int j = first(1); j <= last(1, ny_); ++j)
      for (int i = first(0); i <= last(0, nx_); ++i) {
        const Vector2d p = origin_ + cell * Vector2d(i, j);
        double& v =
            value_[static_cast<size_t>(j) * static_cast<size_t>(nx_) + static_cast<size_t>(i)];
        v = std::min(v, (p - c.head<2>()).norm() - c.z());
      }
  }
}

double DistanceField::At(const Vector2d& p) const {
  const double x = (p.x() - origin_.x()) / cell_, y = (p.y() - origin_.y()) / cell_;
  if (!(x >= 0.0 && y >= 0.0 && x < nx_ - 1 && y < ny_ - 1)) return cut_;
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const double u = x - i, v = y - j;
  const double* a =
      &value_[static_cast<size_t>(j) * static_cast<size_t>(nx_) + static_cast<size_t>(i)];
  const double* b = a + nx_;
  return (1.0 - v) * ((1.0 - u) * a[0] + u * a[1]) + v * ((1.0 - u) * b[0] + u * b[1]);
}

double DistanceField::LeastAlong(const Vector2d& a, const Vector2d& b, double enough) const {
  const int n = std::max(1, static_cast<int>(std::ceil((b - a).norm() / cell_)));
  double least = cut_;
  for (int i = 0; i <= n && least >= enough; ++i)
    least = std::min(least, At(a + (b - a) * (static_cast<double>(i) / n)));
  return least;
}

bool DistanceField::IsOf(const std::vector<world::Obstacle>& obstacles) const {
  return circles_ == Circles(obstacles);
}

}  // namespace chase::baselines
