#pragma once

#include <string>

#include "common/logs/log_reader.h"
#include "logs/src/identification.h"

namespace chase::logs {

/// What identification goes by: IMU, POSE and ATTITUDE_SETPOINT while TRACKING says that a plan,
/// its stop or braking is flown, in the air, with a pose that is usable. Throws std::runtime_error
/// with one line where one of these channels is missing, or is there for several vehicles.
FlightSamples ReadSamples(const std::string& log, const Watch& watch = {});

}  // namespace chase::logs
