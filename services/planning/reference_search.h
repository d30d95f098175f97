#pragma once

#include <Eigen/Core>

#include "services/planning/search.h"

namespace chase::planning {

/// K^-1 of Jeon 2021, section IV-B, with the objective (11) in normalised time.
Eigen::MatrixXd InverseKkt(const PlannerConfig& config, const Problem& problem);

/// Candidate `index` from the KKT system.
Curve ReferenceCandidate(const PlannerConfig& config, const Problem& problem,
                         const Eigen::MatrixXd& inverse_kkt, int index);

/// Jeon 2021, sections IV and V, in the plainest code: power basis of normalised time, the KKT
/// system, every candidate checked and the feasible ones weighed.
std::unique_ptr<Search> MakeReferenceSearch(const PlannerConfig& config, Arithmetic arithmetic);

}  // namespace chase::planning
