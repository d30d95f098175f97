#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace chase::campaign {

/// The rows of a campaign's tables: flights of one place (scenario or world:KIND) and one fault, in
/// the order of their first flight.
struct Row {
  std::string place, fault;
  std::vector<const nlohmann::ordered_json*> flights;  ///< entries of flights.json

  std::string Title() const { return fault.empty() ? place : place + ", " + fault; }
};
std::vector<Row> RowsOf(const std::vector<nlohmann::ordered_json>& flights);

/// The values of a key in the flights that have it as a number.
std::vector<double> Values(const Row& row, const std::string& key);

/// table.md: one row per place and fault, one per kind of fault over all places, the pooled row,
/// and the failed flights with their reports and the line that repeats each. Holds nothing that
/// differs between two runs of the same flights.
std::string Table(const std::vector<nlohmann::ordered_json>& flights);

}  // namespace chase::campaign
