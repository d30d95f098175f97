#pragma once

#include <string>
#include <vector>

#include "services/planning/planner.h"
#include "test/baselines/pieces.h"

namespace chase::baselines {

/// A static ellipsoid grown by the drone's radius.
struct Body {
  Eigen::Vector3d center;  ///< frame W, m
  Eigen::Matrix3d R;       ///< 1/m^2
  double radius;           ///< of the bare section in the plane, m
};

/// Obstacles whose surface is less than `reach` metres from a point of the target's horizon.
std::vector<Body> NearBodies(const planning::PlannerConfig& config,
                             const planning::PlanRequest& request, double reach = 6.0);

/// ||p - o||_R^2 and its gradient with respect to p; below 1 inside.
double SafetyDistance(const Body& body, const Eigen::Vector3d& p, Eigen::Vector3d* gradient);

/// min over s in [0,1] of ||p + s (q - p) - o||_R^2 and its gradient with respect to p, which
/// exists everywhere but has kinks (envelope theorem).
double SightDistance(const Body& body, const Eigen::Vector3d& p, const Eigen::Vector3d& q,
                     Eigen::Vector3d* gradient);

/// What dense sampling says of a plan: kChase when it is safe, in sight and within the limits
/// (speed and acceleration per axis, height), kSafeOnly when sight fails, else kBrake, which claims
/// nothing; `reason` says why not kChase.
planning::Verdict Examine(const planning::PlannerConfig& config,
                          const planning::PlanRequest& request, const Pieces& plan,
                          std::string* reason);

/// Largest violation of safety or sight at the samples of `Examine`, in units of d; 0: none.
/// Without `sight` safety only.
double Violation(const planning::PlannerConfig& config, const planning::PlanRequest& request,
                 const Pieces& plan, bool sight);

/// What a rival flies when it finds nothing: the rest of the running plan, or braking when that is
/// over.
planning::PlanResult KeepOrBrake(const planning::PlannerConfig& config,
                                 const planning::PlanRequest& request, const std::string& why);

/// The plan with its verdict.
planning::PlanResult Answer(const planning::PlannerConfig& config,
                            const planning::PlanRequest& request, const Pieces& plan);

/// A planner of the comparison: what all rivals share.
class Rival : public planning::Planner {
 public:
  explicit Rival(const planning::PlannerConfig& config) : config_(config) {}
  bool IsCertified(const planning::PlanRequest& request, const world::Trajectory& plan) override;

 protected:
  planning::PlannerConfig config_;
};

/// False when the request holds numbers that are not finite, or no time.
bool IsSound(const planning::PlanRequest& request);

}  // namespace chase::baselines
