#pragma once

#include <string>

#include "chase/obstacles_t.hpp"
#include "chase/plan_t.hpp"
#include "chase/prediction_t.hpp"

namespace chase::logs {

/// What a plan is held against.
struct Grounds {
  const obstacles_t* list = nullptr;       ///< the OBSTACLES that it names; null: it names none
  const prediction_t* forecast = nullptr;  ///< the PREDICTION that it names; null: not in the log
  double hard_radius = 0.0, sigmas = 0.0;  ///< least that it has to claim, m and 1
};

struct Examination {
  std::string fault;    ///< why the plan is no plan to fly; empty: none found
  long unverified = 0;  ///< proofs about what neither OBSTACLES nor PREDICTION tells
};

/// Checks what the message claims, in rational arithmetic without rounding, from the definitions in
/// lcmtypes: with planning, or the check that control flies by, it shares constants only. Square
/// roots are rounded to the safe side. A certified plan has to keep off each listed solid by its
/// clearance, off the target's body, and its stop off both; to see past each solid all the time
/// where its verdict says so, by the radii that it gives; to come to rest; to be about a list of
/// its own time.
Examination Examine(const plan_t& plan, const Grounds& grounds);

}  // namespace chase::logs
