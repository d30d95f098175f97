#pragma once

#include "common/world/plan_check.h"
#include "services/planning/planner.h"

namespace chase::planning {

/// What control is told of a plan.
inline world::Claim ClaimOf(const PlanResult& plan, const world::Trajectory& target,
                            const PlannerConfig& c) {
  world::Claim claim;
  claim.position = plan.trajectory;
  claim.target = target;
  claim.stop = plan.stop;
  claim.proofs = plan.proofs;
  claim.stop_proofs = plan.stop_proofs;
  claim.hard_radius = c.hard_radius();
  claim.sigmas = c.sigmas;
  claim.certified = plan.certified_clearance >= 0.0;
  claim.last_resort = plan.verdict == Verdict::kBrake || plan.verdict == Verdict::kWait ||
                      plan.verdict == Verdict::kMitigate;
  claim.starts_inside = claim.last_resort || plan.verdict == Verdict::kEscape;
  return claim;
}

}  // namespace chase::planning
