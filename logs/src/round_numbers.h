#pragma once

#include <nlohmann/json.hpp>

namespace chase::logs {

/// Every number with a fraction to six significant digits: 1.55, not 1.5499999999999998.
void RoundNumbers(nlohmann::ordered_json* json);

}  // namespace chase::logs
