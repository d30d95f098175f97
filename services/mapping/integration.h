#pragma once

#include <deque>
#include <vector>

#include "services/mapping/enclosing.h"
#include "services/mapping/ray_walk.h"
#include "services/mapping/sweep.h"
#include "services/mapping/voxel_grid.h"

namespace chase::mapping {

/// Puts sweeps into the grid: one hit per cell and sweep, one ray per hit cell, at most one miss
/// per cell and sweep. Cost is bounded by the returns of a sweep, whatever was mapped before.
class Integrator {
 public:
  Integrator(const GridConfig& config, VoxelGrid* grid) : config_(config), grid_(*grid) {}

  void Insert(const Eigen::Vector3d& origin, const std::vector<Return>& returns);

  /// Empties the cells whose centre lies within `radius` m of `center` in plan and between two
  /// heights; cells hit in more than `settled` sweeps stay, and so do those that the last sweep hit
  /// unless `also_hit`, and those outside `within`, if given.
  void ClearDisc(const Eigen::Vector2d& center, double radius, double bottom, double top,
                 int settled, bool also_hit, const Ellipse* within = nullptr);

  /// Empties cells that a body filled on its way: those that were last hit while the body, now
  /// within `outline` and moved by `step` m a sweep, lay over them, at most `most` sweeps ago, and
  /// that were hit hardly longer than that. Between two heights.
  void ClearPassed(const Ellipse& outline, const Eigen::Vector2d& step, double most, double bottom,
                   double top);

  /// Cells whose state changed and that the octree does not know yet, most urgent first.
  std::deque<Key>& changes() { return changes_; }
  uint32_t sweep() const { return sweep_; }

 private:
  struct HitCell {
    Key key;
    VoxelGrid::Column* column = nullptr;
    Voxel* voxel = nullptr;
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    int count = 0, solid = 0, ground = 0, moving = 0;
    ExtentMeter meter;
  };
  void Gather(const std::vector<Return>& returns);
  void Hit(HitCell* cell);
  void CastRays(const Eigen::Vector3d& origin, size_t first, size_t n);
  void Miss(const Key& key);
  bool PassesReturns(const Voxel& voxel, const Key& key) const;
  int8_t PassingHeight(const Key& key) const;
  void Reset(VoxelGrid::Column* column, Voxel* voxel, const Key& key);
  void SetOccupied(VoxelGrid::Column* column, Voxel* voxel, const Key& key);
  void Queue(Voxel* voxel, const Key& key);

  GridConfig config_;
  VoxelGrid& grid_;
  uint32_t sweep_ = 0;
  std::vector<HitCell> cells_;
  CellSet done_;                       ///< cells in which a ray changes nothing more this sweep
  CrossedCells crossed_[kRaysAtOnce];  ///< the others that each ray crosses
  std::deque<Key> changes_;
  Eigen::Vector3d ray_origin_, ray_direction_;
};

}  // namespace chase::mapping
