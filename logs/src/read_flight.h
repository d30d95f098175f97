#pragma once

#include <string>

#include "chase/truth_t.hpp"
#include "logs/src/flight_record.h"

namespace chase::logs {

/// Mission time zero in the time of `truth`, microseconds.
int64_t MissionStart(const truth_t& truth);
/// The sample of a message; `start` is mission time zero, microseconds.
TruthSample ToSample(const truth_t& message, int64_t start);

/// Is a touch of the ground at `speed` [m/s] a landing in a state of flight_state_t, while control
/// comes down by itself or not?
bool MayStand(int state, bool descends, double speed);

/// Reads what metrics need from a flight log; a channel prefix is left out of account. Throws
/// std::runtime_error with one line when the file is no log or holds no SCENARIO or TRUTH.
FlightRecord ReadFlight(const std::string& log);

}  // namespace chase::logs
