#include "common/bus/battery.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace chase::bus {

std::string BatteryWords(double share) {
  char words[32];
  std::snprintf(words, sizeof words, "battery %.0f %%",
                std::floor(100.0 * std::clamp(share, 0.0, 1.0)));
  return words;
}

std::optional<double> BatteryIn(const status_t& status) {
  if (status.name != "fcu") return std::nullopt;
  // The autopilot's own texts are quoted before it, and may speak of the battery, too.
  const size_t at = status.detail.rfind("battery ");
  int percent = 0, end = 0;
  if (at == std::string::npos ||
      std::sscanf(status.detail.c_str() + at, "battery %3d %%%n", &percent, &end) != 1 ||
      end == 0 || percent < 0 || percent > 100)
    return std::nullopt;
  return 0.01 * percent;
}

}  // namespace chase::bus
