#pragma once

#include <Eigen/Core>

#include "services/mapping/mapping_config.h"

namespace chase::mapping {

/// What perception says of the target. Frame W.
struct TargetEstimate {
  double t = 0.0;                                      ///< s, time of the mean
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();      ///< p_WT, centre, m
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s
  double sigma = 0.1;                                  ///< of the mean, horizontal, m
  double radius = 0.15, height = 0.5;                  ///< of its upright cylinder, m
  bool seen = true;                                    ///< false: perception's own prediction
};

/// The upright cylinder that belongs to the target at the time of a sweep, from the ground (its
/// carrier) to a little above its top. After a loss it follows perception's predictions, then the
/// last velocity, until the target was seen last `hold` ago.
class TargetZone {
 public:
  explicit TargetZone(const TargetConfig& config) : config_(config) {}

  /// The newest estimate. Predicted ones move the zone, but do not make it last.
  void Observe(const TargetEstimate& estimate);
  /// Moves the zone to time t [s]; inactive when the target was not seen for too long.
  void MoveTo(double t);

  bool active() const { return active_; }
  /// It was seen of late: it is where it is believed to be, and nothing else is.
  bool in_view() const { return in_view_; }
  const Eigen::Vector2d& center() const { return center_; }
  /// Radius within which returns are left out, and the one within which cells are always cleared:
  /// smaller, but for the first second that the target is known; 0 m while it is not in view.
  double outer() const { return outer_; }
  double core() const { return core_; }
  /// No outline of an obstacle may come nearer than this to the centre.
  double keep_out() const { return last_.radius; }
  double top() const { return top_; }
  template <class Vector>
  bool Holds(const Vector& p) const {
    return active_ && p.z() < top_ &&
           (p.template head<2>().template cast<double>() - center_).squaredNorm() < outer_ * outer_;
  }

 private:
  TargetConfig config_;
  TargetEstimate last_;
  double first_seen_ = 0.0;  ///< s, of the first estimate
  double last_seen_ = 0.0;   ///< s, of the newest estimate that was not a prediction
  bool seen_ = false, active_ = false, in_view_ = false;
  Eigen::Vector2d center_ = Eigen::Vector2d::Zero();
  double outer_ = 0.0, core_ = 0.0, top_ = 0.0;
};

}  // namespace chase::mapping
