#pragma once

#include "services/prediction/candidate_table.h"
#include "services/prediction/search.h"

namespace chase::prediction {

/// Exact search for N_v^N_o up to some hundred thousand: rows of the table from the cheapest middle
/// on, in each the groups and points whose lower bounds are below the cheapest clear candidate
/// known, the cheapest first. Each gets the certified test; where it collides, everything that lies
/// inside the same obstacle at the same time is struck out, group-wise where that is possible.
/// Stops after `visit_limit` rows and groups; then lower_bound certifies how far off the result can
/// be at most.
class TableSearch {
 public:
  explicit TableSearch(const CandidateSet& candidates, const Kernels& kernels = BestKernels())
      : table_(candidates, kernels) {}

  SearchResult Run(const std::vector<HorizonObstacle>& obstacles, int64_t visit_limit) const;

 private:
  CandidateTable table_;
};

}  // namespace chase::prediction
