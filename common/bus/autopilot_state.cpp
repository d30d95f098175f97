#include "common/bus/autopilot_state.h"

#include <string>

#include "common/world/ages.h"

namespace chase::bus {

// The words are the bridge's: "flying: ...; mode OFFBOARD, armed, in air, ...". Texts of the
// autopilot's own are quoted before the last mode.
void AutopilotState::Hear(const status_t& message) {
  const size_t at = message.detail.rfind("; mode ");
  const bool tells = at != std::string::npos;
  if (message.name != "fcu" || (!tells && heard_ == 0)) return;
  const auto says = [&](const char* words) {
    return tells && message.detail.find(words, at) != std::string::npos;
  };
  heard_ = message.utime;
  obeys_ = message.detail.rfind("flying: ", 0) == 0 && says(", armed, ");
  on_ground_ = says(", on ground");
}

bool AutopilotState::IsKnown(int64_t utime) const {
  return heard_ != 0 && 1e-6 * static_cast<double>(utime - heard_) <= world::kMostAge.status;
}

}  // namespace chase::bus
