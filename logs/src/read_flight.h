#pragma once

#include <string>
#include <vector>

#include "chase/obstacles_t.hpp"
#include "chase/truth_t.hpp"
#include "logs/src/flight_record.h"

namespace chase::logs {

/// Mission time zero in the time of `truth`, microseconds.
int64_t MissionStart(const truth_t& truth);
/// The sample of a message; `start` is mission time zero, microseconds.
TruthSample ToSample(const truth_t& message, int64_t start);

/// The obstacles of a list at its own time, without the ground.
std::vector<PerceivedObstacle> PerceivedIn(const obstacles_t& message);

/// Reads what metrics need from a flight log; a channel prefix is left out of account. Throws
/// std::runtime_error with one line when the file is no log or holds no SCENARIO or TRUTH.
FlightRecord ReadFlight(const std::string& log);

}  // namespace chase::logs
