#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "services/planning/pilot_inputs.h"
#include "services/planning/planning_config.h"
#include "services/planning/whereabouts.h"

namespace chase::planning {

/// Where to look, and to go, for a target that was seen and is lost.
class TargetSearch {
 public:
  explicit TargetSearch(const PlanningConfig& config) : config_(config) {}

  /// It is chased: a search begins where it was in sight last.
  void Saw(const Forecast& forecast);
  /// Was it ever seen in this frame?
  bool has_seen() const { return has_seen_; }
  void Clear();

  struct Lead {
    double yaw = 0.0;  ///< to look along, rad
    std::optional<Eigen::Vector3d>
        place;  ///< to go to, frame W; none: enough is in sight from here
  };
  /// The body is `body` at time t [s], when nothing is in sight; whoever follows the answer does so
  /// from `start`, looking along `yaw` [rad].
  Lead Advance(double t, const std::vector<world::Obstacle>& obstacles, const BodyEstimate& body,
               const Eigen::Vector3d& start, double yaw);

 private:
  PlanningConfig config_;
  Whereabouts whereabouts_;
  bool has_seen_ = false;
  world::Trajectory last_seen_;                      ///< its forecast when it was in sight last
  double last_seen_sigma_ = 0.0;                     ///< of its place then, m
  double fastest_ = 0.0;                             ///< that it was seen to move, m/s
  Eigen::Vector3d place_ = Eigen::Vector3d::Zero();  ///< from which it is looked for, m
  double place_chosen_ = -1e9;                       ///< s
};

}  // namespace chase::planning
