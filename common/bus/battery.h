#pragma once

#include <optional>
#include <string>

#include "chase/status_t.hpp"

namespace chase::bus {

/// FCU_STATUS says of the battery in its detail: "battery 80 %".
std::string BatteryWords(double share);

/// The share of the charge, 0 to 1, that a status tells; nothing where it tells none.
std::optional<double> BatteryIn(const status_t& status);

}  // namespace chase::bus
