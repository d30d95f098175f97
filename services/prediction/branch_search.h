#pragma once

#include "services/prediction/search.h"

namespace chase::prediction {

/// Best-first branch and bound for candidate sets too large for tables. A node allows a subset of
/// points per observation. Its bound: J is convex and delta lies in the sum of the hulls of the
/// allowed contributions, so at any point delta0 of it
///   J(V) >= J(delta0) + sum_n min_i grad J(delta0)' (c(n, i) - delta0_n),
/// which separates per observation; a few pairwise Frank-Wolfe steps move delta0 towards the least
/// J of the hull. Points whose reduced cost exceeds the best known candidate are struck out, and
/// nodes that lie wholly inside an obstacle at some time are dropped. Exact when it ends before
/// `node_limit` nodes; else lower_bound certifies how far off the result can be at most.
SearchResult BranchSearch(const CandidateSet& candidates,
                          const std::vector<HorizonObstacle>& obstacles, int node_limit);

}  // namespace chase::prediction
