#pragma once

#include <Eigen/Core>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/world/obstacle.h"
#include "services/mapping/decomposition.h"
#include "services/mapping/ground.h"
#include "services/mapping/integration.h"
#include "services/mapping/mapping_config.h"
#include "services/mapping/motion_detector.h"
#include "services/mapping/occupancy_tree.h"
#include "services/mapping/sweep.h"
#include "services/mapping/target_zone.h"
#include "services/mapping/tracker.h"
#include "services/mapping/voxel_grid.h"

namespace chase::mapping {

/// What the planner should know after a sweep.
struct ObstacleList {
  std::vector<world::Obstacle> obstacles;  ///< nearest to the drone first, then the ground; frame W
  int n_cut = 0;                           ///< left out because the list is bounded
  int n_static = 0, n_moving = 0;          ///< listed and cut
  int n_dropped = 0;                       ///< single columns left out because the target is there
  std::vector<world::Obstacle> unseen;     ///< places near the drone where nothing was seen
};

/// Sweeps in, obstacles and an octree out. Everything solid above the ground near the flight volume
/// is enclosed by upright ellipsoids; what moves is tracked apart; the target is neither.
class Mapper {
 public:
  explicit Mapper(const MappingConfig& config);

  void ObserveTarget(const TargetEstimate& estimate) { zone_.Observe(estimate); }
  /// Maps a sweep. Cost is bounded by the size of the sweep and of the window.
  ObstacleList Insert(const Sweep& sweep);
  /// Hands news to the octree, at most updates_per_sweep cells. Call after the list went out.
  void UpdateTree();

  /// Hands all pending news to the octree, whatever that costs. For the end of a flight.
  void CompleteTree();
  /// The octree in OctoMap's "bt" format, and the number of its occupied cells.
  std::string WriteTree(int* occupied) { return tree_.Write(occupied); }
  /// Tiles that left the octree since the last call (config tree.keep_tiles).
  std::vector<SavedTile> TakeTiles();

  VoxelGrid& grid() { return grid_; }
  const OccupancyTree& tree() const { return tree_; }
  GroundModel& ground() { return ground_; }
  const Tracker& tracker() const { return tracker_; }
  size_t Bytes() const;

 private:
  void Prepare(const Sweep& sweep);
  bool Shorten(const Eigen::Vector3d& origin, Eigen::Vector3d* end) const;
  void MarkTarget(const std::vector<Footprint>& movers);
  void TrackMovers(const Sweep& sweep, const std::vector<Footprint>& expected);
  void ClearGhosts(double t);
  bool IsUnseen(const Key& key, const Eigen::Vector3d& origin);
  std::vector<Cell> OccupiedColumns(const Eigen::Vector3d& origin, std::set<int>* partial);
  bool ColumnExtent(const VoxelGrid::Column& column, Extent* extent);
  std::vector<world::Obstacle> Statics(const Eigen::Vector3d& origin, double t, int* dropped);
  std::vector<world::Obstacle> Unseen(const Eigen::Vector3d& origin, double t);
  world::Obstacle Upright(int id, const Ellipse& outline, double t);
  void StopAtWalls(world::Obstacle* mover);
  void SetTree(int most);

  MappingConfig config_;
  VoxelGrid grid_;
  Integrator integrator_;
  GroundModel ground_;
  TargetZone zone_;
  MotionDetector detector_;
  Tracker tracker_;
  Decomposition decomposition_, unseen_;
  std::map<std::pair<int, int>, int> unseen_pieces_;  ///< of the columns x, y
  OccupancyTree tree_;
  std::vector<Return> returns_;
  std::vector<Eigen::Vector3f> near_;
  std::vector<SavedTile> tiles_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  double t_ = 0.0;  ///< s, of the last sweep
};

/// Sorts by distance of the outline from `origin` at the obstacles' own start and keeps `most`.
/// Returns how many were cut.
int KeepNearest(const Eigen::Vector3d& origin, int most, std::vector<world::Obstacle>* obstacles);

}  // namespace chase::mapping
