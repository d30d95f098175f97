#pragma once

#include <string>
#include <vector>

#include "chase/plan_t.hpp"
#include "common/world/plan_check.h"

namespace chase::bus {

std::vector<world::Proof> FromMessage(const std::vector<proof_t>& messages);
std::vector<proof_t> ToMessage(const std::vector<world::Proof>& proofs);

/// What the plan says of itself, times in seconds from `origin`.
world::Claim ClaimOf(const plan_t& m, int64_t origin);

/// `seq` of the message of `channel` that the plan was made from; -1: none.
int32_t InputOf(const plan_t& m, const std::string& channel);

}  // namespace chase::bus
