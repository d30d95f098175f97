#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "services/planning/planner.h"
#include "services/planning/problem.h"

namespace chase::planning {

/// A way to rest, and how well it is known to be clear.
struct Stop {
  world::Trajectory trajectory;
  std::vector<Proof> proofs;
  bool certified = false;
  bool aside = false;  ///< of Evade(): leads elsewhere than braking does
  bool blind = false;  ///< leads into what nobody has looked into
  bool lasts = false;  ///< whoever stays at its end is certified clear for as long as stepping
                       ///< aside takes
};

/// Would control fly that leg? It keeps to the geofence.
using MayFly = std::function<bool(const world::Trajectory& leg)>;

/// Comes to rest along BrakeCurve(). Of several durations the shortest that is certified clear of
/// obstacles and of the target's body within the limits. Sight is not asked for.
std::optional<Stop> Brake(const PlannerConfig& config, const PlanRequest& request);

/// Comes to rest at `end`, certified as Brake() is; the quickest of three ways at a leisurely pace.
std::optional<Stop> GoTo(const PlannerConfig& config, const PlanRequest& request,
                         const Eigen::Vector3d& end);

/// The rest of a way to rest from the request's start on, where it is still certified.
std::optional<Stop> GoOn(const PlannerConfig& config, const PlanRequest& request,
                         const world::Trajectory& way);

/// Does the way keep off what moves, the target too, over the request's horizon?
bool KeepsOffMovers(const PlannerConfig& config, const PlanRequest& request,
                    const world::Trajectory& way);

/// Where Evade comes to rest, seen from where braking does, frame W, m; by distance.
std::vector<Eigen::Vector3d> PlacesAside();

/// Out of the way: comes to rest near where braking would, of all places tried the nearest that can
/// be certified, also up and down, those first that last. Where none can: the one whose first
/// contact is the latest, then the one that stays farthest off; not certified.
Stop Evade(const PlannerConfig& config, const PlanRequest& request);

/// When the stop of a plan begins where it can, s after its start.
using world::kOverdue;

/// Do the proofs hold only once an obstacle is left that the start is in? Such a plan is an ESCAPE.
bool LeavesObstacles(const std::vector<Proof>& proofs);

/// The least distance that the proofs of safety keep the drone's centre off anybody, m: 0 where one
/// is left first, infinite where there are none.
double LeastKept(const std::vector<Proof>& proofs);

/// What was committed to with the running plan, not certified: what is left of it until its stop,
/// and the stop.
std::optional<PlanResult> AsCommitted(const PlanRequest& request);

/// The plan without its proofs, as what they prove does not hold.
PlanResult AsLastResort(const std::string& why, PlanResult plan);

/// Brake, the rest of the running plan until its stop and that stop, or else Evade, as a plan; the
/// reason says what it is not.
PlanResult RestPlan(const PlannerConfig& config, const PlanRequest& request);

/// What the proofs, and the height above the ground, leave to the drone's sphere goes with them;
/// after the trajectory.
void SetProofs(const PlannerConfig& config, const PlanRequest& request, std::vector<Proof> proofs,
               PlanResult* result);

/// Where `plan` can be left for a certified rest: as soon as a new plan is overdue, else sooner or
/// later; above the target or by braking, or else aside. It keeps the hard radius and gives up the
/// margin. After FASTER, Tordesillas et al. 2019: a plan is flown only with such a way out.
/// What is unseen is kept off until then and after, and what moves for longer than the proofs of
/// the plan count on it. `leaves`: the plan leaves obstacles that its start is in, and the stop may
/// begin within them. `memory`: of an earlier call, if any.
std::optional<Stop> WayOut(const PlannerConfig& config, const PlanRequest& request,
                           const world::Trajectory& plan, bool leaves = false,
                           Problem* memory = nullptr);

}  // namespace chase::planning
