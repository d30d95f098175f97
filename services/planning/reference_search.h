#pragma once

#include <memory>
#include <vector>

#include "services/planning/search.h"

namespace chase::planning {

/// Candidates of Jeon 2021, section IV-B, from the KKT system with the objective (11) in normalised
/// time. The solution is affine in the skeletons: every candidate is the start's part and one term
/// per step.
class KktCandidates {
 public:
  KktCandidates(const PlannerConfig& config, const Problem& problem);
  Curve operator()(int index) const;

 private:
  Curve base_;
  std::vector<std::vector<Curve>> terms_;  ///< [step][choice]
};

/// Jeon 2021, sections IV and V, in the plainest code: power basis of normalised time, the KKT
/// system, every candidate checked and the feasible ones weighed.
std::unique_ptr<Search> MakeReferenceSearch(const PlannerConfig& config, Arithmetic arithmetic);

}  // namespace chase::planning
