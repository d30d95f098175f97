#pragma once

#include "services/planning/fast_kernels.h"
#include "services/planning/search.h"

namespace chase::planning {

/// The reference's winner in tens of microseconds:
/// 1. time normalised, origin at the target, Bernstein form: of a quintic only b4 and b5 are free;
/// 2. a candidate is a sum of table entries, its J1 a sum of squares;
/// 3. obstacles that a plane separates from all candidates and the target are left out;
/// 4. the cheapest by J1 first, J3 and J4 on top, then by lower bounds in batches of 16;
/// 5. per batch J2, then feasibility in 8 lanes by subdivision, single precision with a margin;
/// 6. whatever is still open is certified in double, and exactly where that does not do;
/// 7. the bound prunes the rest; when nothing is feasible early, all are tested side by side.
/// The winner is compared in double and certified before it is returned. Once 64 candidates have
/// been refused by the proof it is the best of those proven by then, -1 where there is none.
std::unique_ptr<Search> MakeFastSearch(const PlannerConfig& config);
std::unique_ptr<Search> MakeFastSearch(const PlannerConfig& config, const kernels::Table& table);

}  // namespace chase::planning
