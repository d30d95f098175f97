#pragma once

#include "services/prediction/search.h"

namespace chase::prediction {

/// Problem 1 of Jeon 2021 as written, the oracle of the tests: the cost of every arrangement, then
/// in the order of cost Sturm's theorem in exact arithmetic (d_q(0) > 1, no root in (0,T]) against
/// every obstacle. `count()` must be small enough to list.
SearchResult ReferenceSearch(const CandidateSet& candidates,
                             const std::vector<HorizonObstacle>& obstacles);

}  // namespace chase::prediction
