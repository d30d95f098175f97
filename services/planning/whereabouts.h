#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/world/obstacle.h"
#include "services/planning/planner_config.h"

namespace chase::planning {

/// Where a target that was lost may be: weighted hypotheses of its way (a particle set, after
/// Bourgault, Furukawa and Durrant-Whyte 2003, searching for lost targets). Each goes on, now and
/// then turns and changes its speed, and goes through nothing that stands. Where the camera looks
/// and finds nothing, the hypotheses lose weight. Deterministic: additive sequences in the place of
/// random numbers. Frame W, m, s.
class Whereabouts {
 public:
  /// The target was last known at time t, at p, with the velocity v; it can move at `fastest`.
  void Begin(double t, const Eigen::Vector3d& p, const Eigen::Vector3d& v, double fastest);
  bool begun() const { return !hypotheses_.empty(); }
  void Clear() { hypotheses_.clear(); }

  /// Moves on to time t; a camera at `eye` that looks along `yaw` [rad] sees no target. A view
  /// without edges sees all around.
  void Advance(double t, const std::vector<world::Obstacle>& obstacles, const Eigen::Vector3d& eye,
               double yaw, const View& view);

  /// The heading that shows most in the shortest time to one that looks along `yaw` and turns at
  /// `rate` [rad/s], and the share of all that can be seen from here, whatever the heading.
  struct Gaze {
    double yaw = 0.0;    ///< rad
    double share = 0.0;  ///< 1
  };
  Gaze BestGaze(double yaw, double rate, const View& view) const;

  /// The place about which most lies within `radius`.
  Eigen::Vector3d Likeliest(double radius) const;

 private:
  struct Hypothesis {
    Eigen::Vector2d p;
    double heading, speed;  // rad, m/s
    double turns_at;        // s
    double weight;
    uint32_t draws;         // taken from its sequence
    double bearing = 0.0;   // from the eye, rad
    bool in_sight = false;  // from the eye, whatever its heading
  };

  void Redirect(uint32_t number, double t, double spread, Hypothesis* h) const;
  void Move(double t, double dt, const std::vector<world::Obstacle>& obstacles);
  void Look(double t, const std::vector<world::Obstacle>& obstacles, const Eigen::Vector3d& eye,
            double yaw, const View& view);
  void Resample();

  std::vector<Hypothesis> hypotheses_;
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();  // where it was last known
  double t_ = 0.0, top_speed_ = 0.0, height_ = 0.0;
};

}  // namespace chase::planning
