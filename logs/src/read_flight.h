#pragma once

#include <string>

#include "logs/src/flight_record.h"

namespace chase::logs {

/// Reads what metrics need from a flight log; a channel prefix is left out of account. Throws
/// std::runtime_error with one line when the file is no log or holds no SCENARIO or TRUTH.
FlightRecord ReadFlight(const std::string& log);

}  // namespace chase::logs
