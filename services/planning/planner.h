#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/world/manoeuvre.h"
#include "common/world/obstacle.h"
#include "common/world/plan_check.h"
#include "common/world/state.h"
#include "common/world/trajectory.h"
#include "services/planning/planner_config.h"
#include "services/planning/yaw.h"

namespace chase::planning {

/// Rung of the ladder that the plan stands on; the numbers of plan_t.
enum class Verdict {
  kChase = 0,
  kWider = 1,
  kKept = 2,
  kSafeOnly = 3,
  kBrake = 4,
  kWait = 5,
  kEscape = 6,
  kMitigate = 7,
};
const char* Name(Verdict verdict);

using world::Proof;
inline constexpr int kTargetId = world::kTargetBody;

/// The stretch of time that a plan is made for, and how it begins.
struct Stretch {
  double t0 = 0.0;         ///< start of the horizon, s
  double horizon = 2.5;    ///< T, s
  world::State start;      ///< at t0
  bool asks_sight = true;  ///< of the target
};

/// One chasing problem (Jeon 2021, Problem 2). Frame W; times in seconds from a common origin.
struct PlanRequest : Stretch {
  std::optional<YawStart> yaw;             ///< at t0; none: towards the target
  double tube = 0.0;                       ///< about the plan, where it is the wider one, m
  world::Trajectory target;                ///< p_WT(t)
  double target_sigma = 0.0;               ///< largest deviation of p_WT at target.start, m
  double target_speed_sigma = 0.0;         ///< and of its velocity, m/s
  world::Manoeuvre target_manoeuvre;       ///< that it does not foresee
  std::vector<world::Obstacle> obstacles;  ///< at their true size
  double listed_within = HUGE_VAL;         ///< of the start, plan view; what is farther is not, m
  std::vector<world::Obstacle> unseen;     ///< places that nobody has looked into
  std::optional<world::Obstacle> target_body;   ///< what the drone must not touch of the target
  std::optional<world::Trajectory> running;     ///< the plan being flown, if any
  std::optional<world::Trajectory> stop;        ///< of that plan; from its start on, flown
  std::vector<world::Trajectory> running_rest;  ///< its further pieces, in order, if it has any
};

/// Of the drone's sphere and the tube about the plan that it stays in, m: never relaxed.
inline double HardRadius(const PlannerConfig& config, const PlanRequest& request) {
  return config.drone_radius + std::max(config.tracking_tube, request.tube);
}

/// Terms of the objective of Problem 2, unweighted, and the weighted total.
struct Cost {
  double j1 = 0.0;  ///< eq. (1): smoothness
  double j2 = 0.0;  ///< eq. (2): nearness of obstacles
  double j3 = 0.0;  ///< eq. (4): distance to the target
  double j4 = 0.0;  ///< eq. (5): yaw rate
  double total = 0.0;
};

struct PlanResult {
  Verdict verdict = Verdict::kBrake;
  std::string reason;            ///< why the verdict is not kChase, and what weakens it; else empty
  world::Trajectory trajectory;  ///< p_WB(t) from t0
  /// Further pieces, each from the end of the one before. Ours has none; planners of other kinds,
  /// such as splines, need them.
  std::vector<world::Trajectory> rest;
  std::vector<double> yaw;  ///< power basis in tau, unwrapped, rad
  bool in_field = false;    ///< certified: the target stays in the image
  /// That the trajectory keeps off all obstacles; none where it is not certified, or where they
  /// stand for ellipsoids without margins, for which the search's own certificate is exact.
  std::vector<Proof> proofs;
  double certified_clearance = -1.0;  ///< least that they leave to the drone's sphere, m; below 0:
                                      ///< not certified
  std::optional<world::Trajectory> stop;  ///< from the trajectory to rest, certified by
  std::vector<Proof> stop_proofs;
  Cost cost;
  int generated = 0;  ///< candidates in the set
  int checked = 0;    ///< candidates tested for feasibility
  int feasible = 0;   ///< of those, feasible
  int winner = -1;    ///< index of the winning candidate; -1: none, or refined
};

/// Answers chasing problems. The same request gets the same answer, bit for bit, whatever was asked
/// before; the object only keeps working memory.
class Planner {
 public:
  virtual ~Planner() = default;

  /// The best certified plan, or the lowest rung of the ladder that can be had.
  virtual PlanResult Plan(const PlanRequest& request) = 0;

  /// True when `plan` is still certified against the request's obstacles, target and limits from
  /// t0 on.
  virtual bool IsCertified(const PlanRequest& request, const world::Trajectory& plan) = 0;
};

/// "chase", "reference" (exact Sturm, exhaustive) or "reference-double" (Sturm in double,
/// exhaustive). Throws std::invalid_argument on another name; the message lists the known ones.
std::unique_ptr<Planner> MakePlanner(const std::string& name, const PlannerConfig& config);
std::vector<std::string> PlannerNames();

}  // namespace chase::planning
