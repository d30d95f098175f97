#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/world/obstacle.h"
#include "services/mapping/enclosing.h"
#include "services/mapping/ground.h"
#include "services/mapping/sweep.h"

namespace chase::mapping {

/// Returns that moved together. Frame W.
struct Cluster {
  std::vector<int> members;                          ///< indices into the sweep's returns
  Points2 hull;                                      ///< in plan, with the side not seen, m
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< of the box around hull, m
  double half_length = 0.0;                          ///< of that rectangle, m
  int track = -1;                                    ///< id of the track that it belongs to
};

/// Finds returns where space has long been free, and what hangs together with them.
class MotionDetector {
 public:
  MotionDetector(const MoverConfig& movers, const GridConfig& grid)
      : config_(movers), ever_free_(grid.ever_free_sweeps) {}

  /// Looks at returns labelled kStatic, seen from `origin`. `expected`: outlines where movers
  /// should be now; returns there count as moving unless a settled cell holds them.
  std::vector<Cluster> Detect(const Eigen::Vector3d& origin, const std::vector<Return>& returns,
                              VoxelGrid* grid, const std::vector<Ellipse>& expected) const;

 private:
  struct Candidate {
    int64_t cell;  ///< code of its cluster cell in plan
    int index;     ///< into the returns
    bool seed;     ///< lies in ever-free space
  };
  std::vector<Candidate> Candidates(const std::vector<Return>& returns, VoxelGrid* grid,
                                    const std::vector<Ellipse>& expected) const;
  bool InEverFree(const Key& key, VoxelGrid* grid) const;
  bool Finish(const Eigen::Vector3d& origin, const std::vector<Return>& returns,
              Cluster* cluster) const;

  MoverConfig config_;
  int ever_free_;
};

/// A moving object: constant velocity Kalman filter of its centre, the same for every axis.
struct Track {
  int id = 0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  ///< centre, frame W, m
  Eigen::Vector3d v = Eigen::Vector3d::Zero();  ///< m/s
  double pp = 0.0, pv = 0.0, vv = 0.0;          ///< covariance per axis
  Eigen::Vector3d birth = Eigen::Vector3d::Zero();
  double born = 0.0, seen = 0.0, moved = 0.0;  ///< s: first, last detection; last time not at rest
  double whole = 0.0;                          ///< s, last detection of its whole length
  int detections = 0;
  bool confirmed = false, fresh = false;  ///< fresh: confirmed by the last update
  Points2 hull;                           ///< of the last cluster about its centre, m
  double half_length = 0.0;               ///< largest seen of late, m
  std::vector<Eigen::Vector2d> trail;     ///< centres until the confirmation

  /// Outline in plan about the present centre that holds the last cluster; thinnest half width m.
  Ellipse Outline() const;
  double Radius() const;
};

/// Keeps tracks of clusters: assignment of least cost within a gate, births, deaths.
class Tracker {
 public:
  explicit Tracker(const MoverConfig& config) : config_(config) {}

  /// Moves all tracks to time t [s].
  void Predict(double t);
  /// Where confirmed tracks are expected at the time of the last prediction.
  std::vector<Ellipse> Expected() const;
  /// Assigns the clusters, which it marks with their track, and may join.
  void Update(std::vector<Cluster>* clusters);
  /// Drops tracks whose centre lies within `radius` of `center` in plan.
  void Forget(const Eigen::Vector2d& center, double radius);

  /// True while returns of this track are to be kept out of the static map.
  bool Moves(int id) const;
  const std::vector<Track>& tracks() const { return tracks_; }
  /// Confirmed tracks that were seen of late, as upright ellipsoids with a linear centre.
  std::vector<world::Obstacle> Obstacles(double middle, double semi_height, double grow) const;

 private:
  void Join(std::vector<Cluster>* clusters) const;
  bool HalfHidden(const Cluster& cluster, const Track& track) const;
  void Correct(const Cluster& cluster, Track* track) const;
  void Birth(Cluster* cluster);
  void Confirm(Track* track) const;
  void Bury();

  MoverConfig config_;
  std::vector<Track> tracks_;
  double t_ = 0.0;
  int next_id_ = 1 << 30;  ///< apart from the ids of static pieces
};

}  // namespace chase::mapping
