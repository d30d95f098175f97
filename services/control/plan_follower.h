#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/world/trajectory.h"
#include "services/control/tracking_law.h"

namespace chase::control {

/// A plan as control needs it: position and yaw over the same interval, and the way to rest that is
/// flown when no newer plan takes over. Without one it ends at rest (`Refute` sees to that).
struct Plan {
  world::Trajectory position;                      ///< p_WB(t)
  Eigen::VectorXd yaw = Eigen::VectorXd::Zero(1);  ///< power basis in normalised time, rad
  std::optional<world::Trajectory> stop;           ///< leaves `position` at its start
  int32_t seq = 0;                                 ///< of the message
  bool to_land = false;  ///< made when a landing had been asked for: its end is above the ground to
                         ///< come down to
  std::optional<double> tube =
      std::nullopt;  ///< radius about it that its certificate allows the body, m
};

/// Turns a stream of plans into one reference. A plan takes over at its own start; until then the
/// one before it is flown. From the start of its stop on the stop is flown, in the stop's own time,
/// while the yaw comes to rest with it; then the end is held. Nothing is extrapolated.
class PlanFollower {
 public:
  /// Takes a plan. It replaces those waiting that start no earlier; one that starts before the plan
  /// being flown is late and left out. Plans that are not finite or have no length are refused.
  bool Add(const Plan& plan);

  /// Reference at time t [s]; nothing before the first plan starts.
  std::optional<Reference> At(double t) const;

  /// Forgets the plans that time t has left behind.
  void Advance(double t);

  void Clear() { *this = {}; }

  /// The plan that is flown at t; null before the first one starts.
  const Plan* FlownAt(double t) const;

 private:
  std::optional<Plan> running_;
  std::vector<Plan> waiting_;  // by start
};

/// Reference of one plan at time t, not before its start.
Reference Sample(const Plan& plan, double t);

/// When the plan is left for its stop, or ends at rest without one, s.
double StopsAt(const Plan& plan);

}  // namespace chase::control
