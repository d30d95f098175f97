#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "test/compare/campaign.h"

namespace chase::compare {

/// The results of the flights, in their order. Throws std::runtime_error when one is missing.
std::vector<nlohmann::ordered_json> ReadFlights(const std::vector<Flight>& flown);

/// flights.csv, flights.json, the figure as PNG and HTML and the top views, and a table on stdout.
/// A picture that cannot be drawn is said on stderr: the figures stand without it.
void WriteResults(const std::vector<Flight>& flown, const Arguments& arguments);

}  // namespace chase::compare
