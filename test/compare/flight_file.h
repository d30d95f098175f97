#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "test/compare/score.h"

namespace chase::compare {

/// What one flight leaves: the figures under the keys of metrics.json, the answers of the planner
/// and the paths for the pictures.
nlohmann::ordered_json FlightJson(const Mission& mission, const std::string& planner,
                                  const Rollout& rollout, const Score& score);

}  // namespace chase::compare
