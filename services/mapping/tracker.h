#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/world/obstacle.h"
#include "services/mapping/body_filter.h"
#include "services/mapping/motion_detector.h"
#include "services/mapping/panorama.h"

namespace chase::mapping {

/// A moving object.
struct Track {
  int id = 0;
  BodyFilter body;
  double z = 0.0;            ///< of the centre of what is seen of it, m
  double half_height = 0.0;  ///< of that, m
  Ellipse outline;           ///< in plan, about body.p()
  double reach = 0.0;        ///< of the outline's corners from body.p(), m
  Eigen::Vector2d birth = Eigen::Vector2d::Zero();
  double born = 0.0, seen = 0.0, moved = 0.0;  ///< s: first, last detection; last time not at rest
  double known = 0.0;                          ///< s, when it was confirmed
  int stood = 0;                               ///< sweeps at rest, until it has left that place
  Eigen::Vector2d rest = Eigen::Vector2d::Zero();  ///< where it rested last, m
  double existence = 0.5;                          ///< probability
  int detections = 0;
  int row = 0;         ///< of them, without a sweep between them in which it was not seen
  double rigid = 0.5;  ///< share of ends in view that moved as those of one body, of late
  bool confirmed = false, fresh = false;  ///< fresh: confirmed by the last update
  std::vector<Eigen::Vector2d> trail;     ///< places until the confirmation

  /// Outline at the present place.
  Ellipse Outline() const { return {body.p() + outline.center, outline.shape}; }
};

/// Keeps tracks of clusters: joint probabilistic association, existence, births, deaths.
class Tracker {
 public:
  explicit Tracker(const MoverConfig& config) : config_(config) {}

  /// Moves all tracks to time t [s].
  void Predict(double t);
  /// Where returns of confirmed tracks whose place is known are expected, at the time of the last
  /// prediction. Tracks at rest too: they may walk on.
  std::vector<Footprint> Expected() const;
  /// Assigns the clusters, which it marks with their track.
  void Update(const Panorama& panorama, std::vector<Cluster>* clusters);
  /// Drops tracks whose centre lies within `radius` of `center` in plan, and those not yet
  /// confirmed within `around`.
  void Forget(const Eigen::Vector2d& center, double radius, double around);

  /// True while returns of this track are to be kept out of the static map.
  bool Moves(int id) const;
  /// Null if there is none.
  const Track* Find(int id) const;
  const std::vector<Track>& tracks() const { return tracks_; }
  /// Confirmed tracks that are more likely there than not and that the static map does not hold, as
  /// upright ellipsoids with a linear centre.
  std::vector<world::Obstacle> Obstacles(double middle, double semi_height, double grow) const;
  /// Tracks that are likelier there than not, not yet known as movers, and too young for the static
  /// map to hold their returns.
  std::vector<const Track*> Unconfirmed() const;

 private:
  bool Rests(const Track& track) const { return t_ - track.moved > config_.settle; }
  double Ratio(const Track& track, const Cluster& cluster) const;
  double Detection(const Track& track, const Panorama& panorama) const;
  void Correct(const Cluster& cluster, Track* track) const;
  void Confirm(Track* track) const;
  void Birth(Cluster* cluster);
  void Unite();
  void Bury();

  MoverConfig config_;
  std::vector<Track> tracks_;
  double t_ = 0.0;
  int next_id_ = 1 << 30;  ///< apart from the ids of static pieces
};

}  // namespace chase::mapping
