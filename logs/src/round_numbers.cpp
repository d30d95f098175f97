#include "logs/src/round_numbers.h"

#include <fmt/format.h>

#include <string>

namespace chase::logs {

void RoundNumbers(nlohmann::ordered_json* json) {
  if (json->is_number_float()) *json = std::stod(fmt::format("{:.6g}", json->get<double>()));
  if (json->is_structured())
    for (auto& item : *json) RoundNumbers(&item);
}

}  // namespace chase::logs
