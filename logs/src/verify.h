#pragma once

#include <string>
#include <vector>

#include "common/logs/log_reader.h"

namespace chase::logs {

/// What an exact check of every plan of a log says.
struct Verification {
  long plans = 0, certified = 0, proven = 0;  ///< proven: certified, every proof verified
  long unheard = 0;                           ///< certified, their OBSTACLES are not in the log
  long proofs = 0, unverified = 0;            ///< the latter about what the log does not tell
  double hard_radius = 0.0, sigmas = 0.0;     ///< least of the certified plans, m and 1
  std::vector<std::string> refuted;           ///< a line per plan that does not hold
  std::vector<std::string> open;              ///< a line per other plan with unverified proofs
  std::vector<Damage> damage;                 ///< of the log: plans may be lost

  bool Told() const {
    return !refuted.empty() || (unheard == 0 && unverified == 0 && damage.empty());
  }
};

/// Checks the proofs of every plan against the obstacles that it was made from, in exact
/// arithmetic. Of each one it asks `hard_radius` m and `sigmas` deviations at least. Throws
/// std::runtime_error where the file is no log, holds no PLAN, or what several vehicles sent.
Verification Verify(const std::string& file, double hard_radius, double sigmas);

std::string Format(const Verification& verification);

}  // namespace chase::logs
