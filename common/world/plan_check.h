#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/math/polynomial.h"
#include "common/world/obstacle.h"
#include "common/world/separation_check.h"
#include "common/world/trajectory.h"

namespace chase::world {

/// That a ball about the drone, or the hull of it and one about the target, stays off an obstacle
/// for tau in [from, 1].
struct Proof {
  int obstacle = 0;  ///< its id; kTargetBody: not one of the list
  bool of_sight = false;
  double from = 0.0;    ///< tau
  double radius = 0.0;  ///< about the drone, m
  /// About the target, coefficients of 1 and tau, m.
  Eigen::Vector2d target_radius = Eigen::Vector2d::Zero();
  Certificate separations;
  double room = 0.0;  ///< least that it proves beyond the radius, m; known to its maker only
};
inline constexpr int kTargetBody = -1;  ///< proofs about the target's own body: nobody lists it

/// When the stop of a plan begins where it can, s after its start: several periods of planning. For
/// so long its own proofs count on where movers may be.
inline constexpr double kOverdue = 0.4;

/// What a plan says of itself. Frame W; times in seconds from a common origin.
struct Claim {
  Trajectory position, target;     ///< p_WB(t), p_WT(t)
  std::optional<Trajectory> stop;  ///< leaves `position` at its start and comes to rest
  std::vector<Proof> proofs, stop_proofs;
  double hard_radius = 0.0;  ///< of sphere and tracking tube, m
  double sigmas = 0.0;       ///< that covariances are taken by
  bool certified = false;    ///< a clearance is claimed
  bool last_resort =
      false;  ///< BRAKE, WAIT or MITIGATE: flown without a certificate if there is none
  bool starts_inside =
      false;  ///< ESCAPE, or a last resort: it may start in an obstacle and leave it
};

/// The least that a proof has to be about, and how it is checked.
struct LeastClaim {
  double hard_radius = 0.0;  ///< m
  double sigmas = 0.0;
  bool exact = false;  ///< in exact arithmetic, milliseconds a proof; else with bounds on rounding
};

/// Nothing where the plan may be flown among the obstacles; else why not. A certified plan has for
/// each of them a proof of safety that holds, and so has its stop; proofs of sight that are there
/// hold too. A plan that is not certified is a last resort. Each plan ends at rest or has a stop
/// that does.
std::string Refute(const Claim& claim, const LeastClaim& least,
                   const std::vector<Obstacle>& obstacles);

/// Is the velocity at its end, and the acceleration, as good as none?
bool EndsAtRest(const Trajectory& position);

}  // namespace chase::world
