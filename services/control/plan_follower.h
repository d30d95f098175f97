#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/world/trajectory.h"
#include "services/control/tracking_law.h"

namespace chase::control {

/// A plan as control needs it: position and yaw over the same interval.
struct Plan {
  world::Trajectory position;                      ///< p_WB(t)
  Eigen::VectorXd yaw = Eigen::VectorXd::Zero(1);  ///< power basis in normalised time, rad
};

/// Turns a stream of plans into one reference. A plan takes over at its own start; until then the
/// one before it is flown. Near its end a plan is flown ever slower, so that the body comes to rest
/// on the path, at the plan's end: nothing is extrapolated.
class PlanFollower {
 public:
  /// `slow_down` is the length of the last part of a plan over which it is slowed to rest, s.
  explicit PlanFollower(double slow_down) : slow_down_(slow_down) {}

  /// Takes a plan. It replaces those waiting that start no earlier; one that starts before the plan
  /// being flown is late and left out. Plans that are not finite or have no length are refused.
  bool Add(const Plan& plan);

  /// Reference at time t [s]; nothing before the first plan starts.
  std::optional<Reference> At(double t) const;

  /// Forgets the plans that time t has left behind.
  void Advance(double t);

  /// Seconds that t lies after the end of the last plan known; negative before it.
  double Overdue(double t) const;

 private:
  double slow_down_;
  std::optional<Plan> running_;
  std::vector<Plan> waiting_;  // by start
};

/// Reference of one plan at time t, slowed to rest over its last `slow_down` seconds.
Reference Sample(const Plan& plan, double t, double slow_down);

}  // namespace chase::control
