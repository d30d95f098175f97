#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "services/mapping/voxel_grid.h"

namespace chase::mapping {

/// A tile that left the octree, as OctoMap's binary stream.
struct SavedTile {
  int x = 0, y = 0, z = 0;  ///< tile numbers; edges are OccupancyTree::kTileCells cells
  std::string bytes;
};

/// The eight octants of a cube: two bits each, as in OctoMap's "bt" stream.
struct Octants {
  enum State : unsigned { kUnknown, kFree, kOccupied, kParted };
  State Get(unsigned i) const { return static_cast<State>(states >> 2 * i & 3u); }
  /// Frees what lay below if the octant is not parted.
  void Put(unsigned i, State state);

  uint16_t states = 0;
  std::unique_ptr<Octants[]> parts;  ///< octants of the parted ones; null if none is
};

/// The long memory: an octree as OctoMap's, pruned at each change, that takes over the grid's cells
/// when their state changes, and forgets tiles far from the drone.
class OccupancyTree {
 public:
  static constexpr int kTileCells = 128;

  explicit OccupancyTree(double resolution) : resolution_(resolution) {}

  /// Sets the state of a cell.
  void Set(const Key& key, bool occupied);
  /// Drops tiles whose centre is farther than `radius` m from p in plan; appends them to `saved`
  /// if that is given.
  void Forget(const Eigen::Vector3d& p, double radius, std::vector<SavedTile>* saved);

  /// Octree in OctoMap's "bt" format with its header; if `within` is given, of the tile that holds
  /// this cell only. Counts occupied cells.
  std::string Write(int* occupied, const Key* within = nullptr) const;
  /// The cell's state: -1 unknown, 0 free, 1 occupied.
  int State(const Eigen::Vector3d& p) const;
  size_t Bytes() const;

 private:
  double resolution_;
  Octants root_;
  std::set<std::tuple<int, int, int>> tiles_;
};

}  // namespace chase::mapping
