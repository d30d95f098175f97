#pragma once

#include <Eigen/Core>

#include "services/mapping/voxel_grid.h"

namespace chase::mapping {

/// As many rays are walked at once.
inline constexpr int kRaysAtOnce = 8;

/// A ray's end and its cell. Frame W, m.
struct RayEnd {
  Eigen::Vector3d p;
  Key cell;
};

/// More than a ray crosses in the window.
inline constexpr int kMostCrossed = 1024;
static_assert(2 * VoxelGrid::kSide + VoxelGrid::kLevels < kMostCrossed);

/// Cells by their number in the window, in the ray's order.
struct CrossedCells {
  int count = 0;
  int cells[kMostCrossed];
};

/// The cells that rays from `origin` cross on their way (Amanatides and Woo 1987) and that are not
/// `done`, the last one excluded. At most kRaysAtOnce rays, all within the window. The same cells
/// on every processor, and as if each ray were walked alone, step by step.
void WalkRays(const VoxelGrid& grid, const Eigen::Vector3d& origin, const RayEnd* ends, int n,
              const CellSet& done, CrossedCells* crossed);

}  // namespace chase::mapping
