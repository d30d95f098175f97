#pragma once

#include "logs/src/metrics.h"

namespace chase::logs {

/// Of one of flight_state_t's constants.
std::string StateName(int state);

/// The states of the flight and, where the last is DONE, how it came down: touchdown is when the
/// body is as low as it stands in the end, give or take 2 cm of springy legs.
void AddLanding(const FlightRecord& record, Metrics* metrics);

/// The flight's state at t; none before its first, or without a mission process.
std::optional<int> StateAt(const FlightRecord& record, double t);

/// Is the flight in LAND or DONE at t?
bool ComesDown(const FlightRecord& record, double t);

/// Were these states there in this order, whatever was between them?
bool InOrder(const std::vector<std::string>& wanted, const std::vector<StateFigures>& states);

}  // namespace chase::logs
