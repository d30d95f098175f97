#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace chase::logs {

/// Which of TRUTH and SCENARIO the log does not hold, as every simulated flight's does; empty: it
/// holds both.
std::string LacksOfTruth(const std::string& log);

/// What the vehicle said of itself.
struct VehicleReport {
  nlohmann::ordered_json metrics;  ///< keys: logs/README.md
  nlohmann::ordered_json series;   ///< for the page: paths, spans, series {t, value}
  double log_begin = 0.0;          ///< time of the log's first event, s from the origin
  int64_t origin = 0;              ///< utime of the report's time zero
  bool whole = true;               ///< the log is neither cut off nor damaged
  bool flew = false;               ///< there is a POSE or a PLAN
  bool tells_states = false;       ///< there is a FLIGHT_STATE
  /// The states that the log begins and ends in, where they are none of standing on the ground.
  std::string begins_in, ends_in;
};

/// `origin`: utime of time zero; none: of the first message. Throws std::runtime_error with one
/// line when the file is no log.
VehicleReport ReportVehicle(const std::string& log, std::optional<int64_t> origin = {});

}  // namespace chase::logs
