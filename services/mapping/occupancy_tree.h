#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "services/mapping/voxel_grid.h"

namespace octomap {
class OcTree;
}

namespace chase::mapping {

/// A tile that left the octree, as OctoMap's binary stream.
struct SavedTile {
  int x = 0, y = 0, z = 0;  ///< tile numbers; edges are OccupancyTree::kTileCells cells
  std::string bytes;
};

/// The long memory: an OctoMap octree that takes over the grid's cells when their state changes,
/// and forgets tiles far from the drone.
class OccupancyTree {
 public:
  static constexpr int kTileCells = 128;

  explicit OccupancyTree(double resolution);
  ~OccupancyTree();

  /// Sets the state of a cell.
  void Set(const Key& key, bool occupied);
  /// Drops tiles whose centre is farther than `radius` m from p in plan; appends them to `saved`
  /// if that is given.
  void Forget(const Eigen::Vector3d& p, double radius, std::vector<SavedTile>* saved);

  /// Octree in OctoMap's "bt" format with its header. Counts occupied leaf cells.
  std::string Write(int* occupied);
  /// The cell's state: -1 unknown, 0 free, 1 occupied.
  int State(const Eigen::Vector3d& p) const;
  size_t Bytes() const;

 private:
  using Tile = std::tuple<int, int, int>;
  std::string Serialise(const Tile& tile) const;
  void Drop(const Tile& tile);

  std::unique_ptr<octomap::OcTree> tree_;
  std::set<Tile> tiles_;
};

}  // namespace chase::mapping
