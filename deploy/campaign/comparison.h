#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace chase::campaign {

/// The flights of a flights.json, or of the one in a folder. Throws std::runtime_error, one line,
/// where it is none.
std::vector<nlohmann::ordered_json> LoadFlights(const std::string& file_or_folder);

struct Comparison {
  std::string text;    ///< a few lines per row that changed, then the verdict
  bool worse = false;  ///< something is worse beyond chance: p < 0.05 after Holm
};

/// What got better and worse from `before` to `now`, row by row and, of two rows or more, pooled
/// over those that both hold. Where both hold the same (place, seed, fault) the pairs are compared:
/// the exact McNemar test for passing and colliding, the sign-flip test and a t interval of the
/// differences for the figures. Else Fisher's exact test, and Welch's test and interval. One family
/// of tests for Holm's adjustment.
Comparison Compare(const std::vector<nlohmann::ordered_json>& before,
                   const std::vector<nlohmann::ordered_json>& now);

}  // namespace chase::campaign
