#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "services/prediction/candidate_set.h"
#include "services/prediction/clearance.h"

namespace chase::prediction {

/// The cheapest candidate that is clear of all obstacles.
struct SearchResult {
  Choice choice;  ///< empty: none found
  double cost = std::numeric_limits<double>::infinity();
  /// No clear candidate costs less than this. Equal to `cost` when the search ran to its end.
  double lower_bound = -std::numeric_limits<double>::infinity();
  int64_t checked = 0;   ///< candidates tested against obstacles
  int64_t nodes = 0;     ///< rows of the table or nodes of the tree that were opened
  bool complete = true;  ///< false: stopped at its limit
  bool found() const { return !choice.empty(); }
};

}  // namespace chase::prediction
