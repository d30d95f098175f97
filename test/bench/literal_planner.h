#pragma once

#include "services/planning/problem.h"

namespace chase::planning {

struct LiteralPlan {
  int index = -1;  ///< of the cheapest feasible candidate, as in Found; -1: none
  int feasible = 0;
  double cost = 0.0;
};

/// Jeon 2021, sections IV and V, as one would write them for a table of run times: time in seconds,
/// power basis, plain arrays, one KKT system for all candidates, one Sturm chain each for d_p and
/// d_s of every candidate and obstacle until one fails, costs of the feasible. Shares with the
/// services' reference the problem, the quadrature's nodes and c(l) of eq. (3); it keeps that one
/// honest.
/// Candidates and target of degree 6 at most, obstacles at constant velocity, one shape for safety
/// and sight, no limits.
LiteralPlan PlanLiterally(const PlannerConfig& config, const Problem& problem);

}  // namespace chase::planning
