#include "services/mapping/forecast.h"

#include <algorithm>
#include <cmath>

#include "common/math/bernstein.h"

namespace chase::mapping {

namespace {

constexpr int kSettledHits = 15;  // sweeps after which a cell is not doubted
constexpr int kDegree = 4;        // of a forecast that stops

bool Stands(const VoxelGrid::Column& column, int low, int high) {
  for (int z = low; z <= high; ++z) {
    const Voxel& voxel = column.voxels[VoxelGrid::Level(z)];
    if (voxel.occupied && voxel.hits >= kSettledHits && !voxel.extent.empty()) return true;
  }
  return false;
}

}  // namespace

double FreeWay(const Eigen::Vector2d& p, const Eigen::Vector2d& d, double most, double low,
               double high, VoxelGrid* grid) {
  const double step = 0.5 * grid->resolution();
  for (double s = 0.0; s < most; s += step) {
    const Eigen::Vector2d q = p + s * d;
    const Key from = grid->ToKey({q.x(), q.y(), low}), to = grid->ToKey({q.x(), q.y(), high});
    const auto* column = grid->Find(from.x, from.y);
    const int bottom = std::max(from.z, grid->z0());
    const int top = std::min(to.z, grid->z0() + VoxelGrid::kLevels - 1);
    if (column && Stands(*column, bottom, top)) return s;
  }
  return most;
}

void StopAfter(double way, world::Obstacle* mover) {
  auto& c = mover->center.coefficients;
  const Eigen::Vector3d start = c.row(0), course = c.row(1);
  const double length = course.norm();
  if (way >= length || !(length > 0.0)) return;
  math::Polynomial gone(kDegree + 1);
  for (int k = 0; k <= kDegree; ++k) gone[k] = std::min(way, length * k / kDegree);
  const math::Polynomial power = math::BernsteinToPower(gone);
  c = power * (course / length).transpose();
  c.row(0) += start.transpose();
}

}  // namespace chase::mapping
