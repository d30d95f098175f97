#pragma once

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "services/mapping/mapper.h"
#include "stage.h"

namespace chase::mapping_stage {

/// What is known of one mover.
struct MoverScore {
  double in_sight = -1.0;  ///< s, when it last came into sight within 12 m
  double last_sight = -1e9;
  double listed = -1.0;  ///< s, first listed since then
  double worst_delay = 0.0;
  double worst_velocity = 0.0, velocity_sum = 0.0;  ///< m/s, error from 1 s after being listed
  double worst_hidden = 0.0;                        ///< the same while something hides part of it
  int sights = 0, missed = 0, updates = 0, hidden_updates = 0;
  int most_hits = 0;  ///< returns at the present range when all of it is in sight, decaying
  /// Squared errors over their published variances, per axis: sums over `judged` updates of the
  /// velocity and of the centre, and how many were beyond what 95 % of them should stay below.
  double velocity_nees = 0.0, center_nees = 0.0;
  int judged = 0, velocity_beyond = 0, center_beyond = 0;
  std::set<int> ids;
};

/// Figures of a flight, from the published lists and the truth.
class Score {
 public:
  Score(const Course& course, const Stage& stage, bool trace)
      : course_(course), stage_(stage), trace_(trace) {}
  void Add(const Shot& shot, const mapping::ObstacleList& list);
  /// Call after the last sweep.
  void Close();

  int sweeps = 0, checks = 0, most = 0, cut = 0;
  long surface = 0, surface_held = 0;  ///< points hit at least three times, and those enclosed
  double worst_coverage = 1.0, blocked_sum = 0.0, worst_blocked = 0.0;
  int id_changes = 0;
  double obstacle_minutes = 0.0;
  int false_movers = 0;  ///< updates that list a mover where there is none
  int ghosts = 0;        ///< updates in which something static stands on a mover's track 1 s later
  int target_blocked = 0;  ///< updates in which the target's centre is inside an obstacle
  int mover_points = 0, mover_points_held = 0;  ///< returns of movers, and those inside obstacles
  std::vector<double> ms;
  std::vector<MoverScore> movers;

 private:
  struct Seen {
    int count = 0;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
  };
  using Cell = std::tuple<int, int, int>;

  double Ground(const Eigen::Vector3d& p) const;
  bool Free(const Eigen::Vector3d& p, const Shot& shot, double distance) const;
  void CheckVolume(const Shot& shot, const std::vector<world::Obstacle>& obstacles);
  void FollowIds(const Shot& shot, const std::vector<world::Obstacle>& obstacles);
  void FollowMovers(const Shot& shot, const std::vector<world::Obstacle>& obstacles);
  void Judge(const world::Obstacle& o, const world::MoverState& truth, double t, int hits,
             MoverScore* score) const;
  static void Trace(const Shot& shot, const world::Obstacle& o, int owner,
                    const std::vector<int>& hits);
  void LookForGhosts(const Shot& shot, const std::vector<world::Obstacle>& obstacles);

  const Course& course_;
  const Stage& stage_;
  bool trace_;  ///< prints every listed mover
  std::map<Cell, Seen> seen_;
  std::map<Cell, Eigen::Vector3d> places_;
  std::map<Cell, int> ids_;  ///< of a place on an obstacle: who holds it
  std::vector<std::vector<std::pair<double, Eigen::Vector3d>>> trails_;
};

}  // namespace chase::mapping_stage
