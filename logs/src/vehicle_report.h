#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace chase::logs {

/// Does the log hold TRUTH, as every simulated flight's does?
bool HoldsTruth(const std::string& log);

/// What a log tells without the truth: what the vehicle said of itself.
struct VehicleReport {
  nlohmann::ordered_json metrics;  ///< keys: logs/README.md
  nlohmann::ordered_json series;   ///< for the page: paths, spans, clearance, tracking error
  bool whole = true;               ///< the log is neither cut off nor damaged
};

/// Throws std::runtime_error with one line when the file is no log or holds neither POSE nor PLAN.
VehicleReport ReportVehicle(const std::string& log);

}  // namespace chase::logs
