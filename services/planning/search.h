#pragma once

#include <limits>
#include <memory>

#include "services/planning/certificate.h"
#include "services/planning/plan_proof.h"
#include "services/planning/problem.h"

namespace chase::planning {

struct Found {
  int index = -1;  ///< of the winner, -1: none is feasible, or the search gave up (fast_search.h)
  Curve plan;      ///< in power basis, as published
  Cost cost;
  int generated = 0, checked = 0, feasible = 0;
};

/// Finds the cheapest feasible candidate of a problem. Candidate i takes choice (i / N_s^n) mod N_s
/// at step n.
class Search {
 public:
  virtual ~Search() = default;

  /// `proof` has been reset to the problem and `sight_from`, the tau from which sight is asked (1:
  /// never; a multiple of 1/4). Candidates that cost more than `bound` need not be found.
  virtual Found Best(const Problem& problem, double sight_from, double bound, PlanProof* proof) = 0;

  /// The same with a proof of its own and no bound; `exact` as for IsInSight.
  Found Best(const Problem& problem, double sight_from, bool exact,
             const kernels::Table& table = kernels::Kernels()) {
    PlanProof proof(table);
    proof.Reset(problem, sight_from, exact);
    return Best(problem, sight_from, std::numeric_limits<double>::infinity(), &proof);
  }
};

}  // namespace chase::planning
