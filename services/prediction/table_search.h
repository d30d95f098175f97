#pragma once

#include "services/prediction/pair_table.h"
#include "services/prediction/search.h"

namespace chase::prediction {

/// Exact search for N_v^N_o up to some hundred thousand. Rows of the pair table are visited by the
/// lower bound of their cheapest candidate, and opened only while that is below the cheapest clear
/// candidate known. In a row, pairs whose bound is too high go first, then those that lie inside an
/// obstacle at a time where others collided, and the rest are tested with certified tests. When
/// the known candidate is far from where the bounds are sharp, they are made anew there.
class TableSearch {
 public:
  explicit TableSearch(const CandidateSet& candidates)
      : table_(candidates), bounds_(table_.MakeBounds(candidates.exponent().constant)) {}

  /// The optimum among all candidates.
  SearchResult Run(const std::vector<HorizonObstacle>& obstacles) const;

 private:
  PairTable table_;
  PairTable::Bounds bounds_;  // sharp near the fit through the means
};

}  // namespace chase::prediction
