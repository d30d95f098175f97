#include "services/mapping/voxel_grid.h"

#include <algorithm>
#include <cmath>

namespace chase::mapping {

namespace {

constexpr int kHysteresis = 6;  // levels that the drone may leave the window's middle by

std::array<float, Extent::kAxes> Project(const Eigen::Vector3f& d) {
  constexpr float kHalfSqrt = 0.70710678f;
  return {d.x(), d.y(), kHalfSqrt * (d.x() + d.y()), kHalfSqrt * (d.x() - d.y()), d.z()};
}

int8_t Clamp(double value) { return static_cast<int8_t>(std::clamp(value, -127.0, 127.0)); }

/// One end of an interval, `seen` outward-positive.
double FollowEnd(double old_end, double seen_end, double noise_steps) {
  const double difference = seen_end - old_end;
  if (difference > 0.0) return old_end + 0.5 * difference;
  return difference > -noise_steps ? old_end + 0.1 * difference : old_end;
}

}  // namespace

VoxelGrid::VoxelGrid(double resolution)
    : resolution_(resolution),
      step_(0.75 * resolution / 127.0),
      columns_(static_cast<size_t>(kSide) * kSide),
      voxels_(columns_.size() * kLevels),
      settled_free_(columns_.size()) {
  for (size_t i = 0; i < columns_.size(); ++i) columns_[i].voxels = &voxels_[i * kLevels];
}

void VoxelGrid::MoveTo(const Eigen::Vector3d& p) {
  const Key k = ToKey(p);
  const int x0 = x0_, y0 = y0_;
  x0_ = k.x - kSide / 2;
  y0_ = k.y - kSide / 2;
  const int middle = z0_ + kLevels / 2;
  const bool level = placed_ && std::abs(k.z - middle) <= kHysteresis;
  if (!level) z0_ = k.z - kLevels / 2;
  placed_ = true;
  if (level && x0 == x0_ && y0 == y0_) return;
  for (int x = x0_; x < x0_ + kSide; ++x)
    for (int y = y0_; y < y0_ + kSide; ++y)
      if (!level || x < x0 || x >= x0 + kSide || y < y0 || y >= y0 + kSide)
        settled_free_[Index(x, y)] = 0;
}

/// The window begins anywhere in the ring of columns, and in that of a column's levels.
void VoxelGrid::SettledFree(CellSet* cells) const {
  static_assert(kLevels == 32);
  auto& columns = cells->columns();
  columns.resize(settled_free_.size());
  const size_t low = Level(z0_);
  for (int x = 0; x < kSide; ++x)
    for (int y = 0; y < kSide; ++y) {
      const uint32_t bits = settled_free_[Index(x0_ + x, y0_ + y)];
      columns[static_cast<size_t>(x * kSide + y)] = bits >> low | bits << (-low & (kLevels - 1));
    }
}

Voxel* VoxelGrid::At(const Key& k) {
  if (!ContainsLevel(k.z)) return nullptr;
  Column* column = Find(k.x, k.y);
  return column ? &column->voxels[Level(k.z)] : nullptr;
}

void VoxelGrid::Renew(Column* column, int x, int y) const {
  const bool same_place = column->x == x && column->y == y;
  if (!same_place) {
    column->piece = 0;
    std::fill_n(column->voxels, kLevels, Voxel());
  } else {  // the window moved up or down: keep the levels that both have
    for (int z = z0_; z < z0_ + kLevels; ++z)
      if (z < column->z0 || z >= column->z0 + kLevels) column->voxels[Level(z)] = Voxel();
  }
  column->x = x;
  column->y = y;
  column->z0 = z0_;
  column->occupied =
      static_cast<int>(std::count_if(column->voxels, column->voxels + kLevels, [](const Voxel& v) {
        return v.occupied && !v.extent.empty();
      }));
}

ExtentMeter::ExtentMeter() {
  low.fill(1e9f);
  high.fill(-1e9f);
}

void ExtentMeter::Add(const Eigen::Vector3f& d) {
  const auto s = Project(d);
  for (size_t i = 0; i < s.size(); ++i) {
    low[i] = std::min(low[i], s[i]);
    high[i] = std::max(high[i], s[i]);
  }
}

void Follow(const ExtentMeter& seen, double step, double noise, Extent* extent) {
  const bool first = extent->empty();
  for (size_t i = 0; i < Extent::kAxes; ++i) {
    const double high = seen.high[i] / step, low = seen.low[i] / step;
    const double new_high = first ? high : FollowEnd(extent->high[i], high, noise / step);
    const double new_low = first ? low : -FollowEnd(-extent->low[i], -low, noise / step);
    extent->high[i] = Clamp(std::ceil(new_high));
    extent->low[i] = Clamp(std::floor(new_low));
  }
}

int PlanCorners(const Extent& e, const Eigen::Vector2d& center, double step,
                std::array<Eigen::Vector2d, 8>* corners) {
  int n = 0;
  const double diagonal = std::sqrt(2.0) * step;
  for (const int sx : {-1, 1}) {
    for (const int sy : {-1, 1}) {
      const double x = step * (sx > 0 ? e.high[0] : e.low[0]);
      const double y = step * (sy > 0 ? e.high[1] : e.low[1]);
      // The slanted side next to this corner: sx x + sy y <= reach.
      const bool sum = sx == sy;
      const double reach =
          diagonal * (sum ? (sx > 0 ? e.high[2] : -e.low[2]) : (sx > 0 ? e.high[3] : -e.low[3]));
      const double side = step * std::min(e.high[0] - e.low[0], e.high[1] - e.low[1]);
      const double cut = std::clamp(sx * x + sy * y - reach, 0.0, side);
      (*corners)[static_cast<size_t>(n++)] = center + Eigen::Vector2d(x, y - sy * cut);
      if (cut > 0.0)
        (*corners)[static_cast<size_t>(n++)] = center + Eigen::Vector2d(x - sx * cut, y);
    }
  }
  return n;
}

Extent Union(const Extent& a, const Extent& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  Extent u;
  for (size_t i = 0; i < Extent::kAxes; ++i) {
    u.low[i] = std::min(a.low[i], b.low[i]);
    u.high[i] = std::max(a.high[i], b.high[i]);
  }
  return u;
}

}  // namespace chase::mapping
