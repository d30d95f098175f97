#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/world/scenario.h"
#include "deploy/worlds/kinds.h"

namespace chase::worlds {

struct Kind {
  std::string name, sentence;
  Draw draw;
};

/// All kinds, in the order of the README.
const std::vector<Kind>& Kinds();

/// The world of a kind and a seed, the same every time: drawn again until it is fair. Throws
/// std::invalid_argument for an unknown kind, std::runtime_error when no draw is fair.
world::Scenario MakeWorld(const std::string& kind, uint64_t seed, const Options& options);

/// The scenario file: compact YAML that loads back to the same scenario.
std::string WorldText(const world::Scenario& scenario);

}  // namespace chase::worlds
