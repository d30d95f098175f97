#include "services/mapping/forecast.h"

#include <algorithm>
#include <cmath>

#include "common/math/bernstein.h"

namespace chase::mapping {

namespace {

constexpr int kSettledHits = 15;  // sweeps after which a cell is not doubted
constexpr int kDegree = 4;        // of a forecast that stops

/// Something settled between two heights in a column, m.
bool Stands(const VoxelGrid& grid, const VoxelGrid::Column& column, double low, double high) {
  for (int z = column.z0; z < column.z0 + VoxelGrid::kLevels; ++z) {
    const Voxel& voxel = column.voxels[VoxelGrid::Level(z)];
    if (!voxel.occupied || voxel.hits < kSettledHits || voxel.extent.empty()) continue;
    const double middle = grid.Center({column.x, column.y, z}).z();
    if (middle + grid.step() * voxel.extent.high[4] >= low &&
        middle + grid.step() * voxel.extent.low[4] <= high)
      return true;
  }
  return false;
}

}  // namespace

double FreeWay(const Eigen::Vector2d& p, const Eigen::Vector2d& d, double most, double low,
               double high, VoxelGrid* grid) {
  const double step = 0.5 * grid->resolution();
  for (double s = 0.0; s < most; s += step) {
    const Eigen::Vector2d q = p + s * d;
    const Key key = grid->ToKey({q.x(), q.y(), low});
    const auto* column = grid->Find(key.x, key.y);
    if (column && Stands(*grid, *column, low, high)) return s;
  }
  return most;
}

double FreeWay(const Ellipse& outline, const Eigen::Vector2d& d, double most, double low,
               double high, VoxelGrid* grid) {
  const Eigen::Matrix2d inverse = outline.shape.inverse();
  const Eigen::Vector2d aside(-d.y(), d.x());
  const Eigen::Vector2d front = outline.center + std::sqrt(d.dot(inverse * d)) * d;
  const Eigen::Vector2d edge = std::sqrt(aside.dot(inverse * aside)) * aside;
  double way = 0.0;
  for (const double side : {-1.0, 0.0, 1.0})
    way = std::max(way, FreeWay(front + side * edge, d, most, low, high, grid));
  return way;
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
