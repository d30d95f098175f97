#pragma once

#include <memory>

#include "services/planning/certificate.h"
#include "services/planning/problem.h"

namespace chase::planning {

struct Found {
  int index = -1;  ///< of the winner, -1: none is feasible
  Curve plan;      ///< in power basis, as published
  Cost cost;
  int generated = 0, checked = 0, feasible = 0;
};

/// Finds the cheapest feasible candidate of a problem. Candidate i takes choice (i / N_s^n) mod N_s
/// at step n.
class Search {
 public:
  virtual ~Search() = default;
  /// Sight is asked from tau = `sight_from` on (1: never); a multiple of 1/4.
  virtual Found Best(const Problem& problem, double sight_from) = 0;
};

}  // namespace chase::planning
