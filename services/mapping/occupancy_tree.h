#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "services/mapping/octree_tile.h"
#include "services/mapping/voxel_grid.h"

namespace chase::mapping {

/// A tile that left the octree, as OctoMap's binary stream.
struct SavedTile {
  int x = 0, y = 0, z = 0;  ///< tile numbers; edges are OccupancyTree::kTileCells cells
  std::string bytes;
};

/// The long memory: OctoMap's octree of 16 levels, which takes over the grid's cells when their
/// state changes and forgets tiles far from the drone. Its upper levels follow from the tiles, so
/// they exist only while it is written.
class OccupancyTree {
 public:
  static constexpr int kTileCells = 1 << OctreeTile::kLevels;

  /// Edge of a cell, m.
  explicit OccupancyTree(double resolution) : resolution_(resolution) {}

  /// Sets the state of a cell. Cells beyond OctoMap's 2^16 per axis are left out.
  void Set(const Key& key, bool occupied);
  /// Drops tiles whose centre is farther than `radius` m from p in plan; appends them to `saved`
  /// if that is given.
  void Forget(const Eigen::Vector3d& p, double radius, std::vector<SavedTile>* saved);

  /// Octree in OctoMap's "bt" format with its header. Counts occupied leaf cells.
  std::string Write(int* occupied) const;
  /// The cell's state: -1 unknown, 0 free, 1 occupied.
  int State(const Eigen::Vector3d& p) const;
  size_t Bytes() const;

 private:
  using TileKey = std::tuple<int, int, int>;

  double resolution_;
  std::map<TileKey, OctreeTile> tiles_;
  std::pair<TileKey, OctreeTile*> last_{{}, nullptr};  ///< set last; the next is mostly the same
};

}  // namespace chase::mapping
