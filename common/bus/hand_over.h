#pragma once

#include <string>

#include "chase/status_t.hpp"

namespace chase::bus {

/// Why the flight is not ours although it has begun, as FCU_STATUS says: a pilot has it, the
/// autopilot lands or has landed it, or never began it; empty: it is ours, or nobody says.
std::string HandOverIn(const status_t& status);

}  // namespace chase::bus
