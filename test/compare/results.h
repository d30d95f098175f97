#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "test/compare/campaign.h"

namespace chase::compare {

/// The results of the jobs, in their order. Throws std::runtime_error when one is missing.
std::vector<nlohmann::ordered_json> ReadFlights(const std::vector<Job>& jobs);

/// flights.csv, flights.json, the figure as PNG and HTML and the top views, and a table on stdout.
void WriteResults(const std::vector<Job>& jobs, const std::string& folder);

}  // namespace chase::compare
