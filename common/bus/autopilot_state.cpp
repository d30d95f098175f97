#include "common/bus/autopilot_state.h"

#include <algorithm>
#include <array>

#include "common/world/ages.h"

namespace chase::bus {

// What the bridge says: "flying: ...; mode OFFBOARD, armed, in air, ...". Texts of the autopilot's
// own are quoted before the last mode.
void AutopilotState::Hear(const status_t& message) {
  static constexpr std::array kNotOurs = {"pilot", "failsafe", "landing", "done", "refused"};
  const size_t at = message.detail.rfind("; mode ");
  const bool tells = at != std::string::npos;
  if (message.name != "fcu" || (!tells && heard_ == 0)) return;
  const auto says = [&](const char* words) {
    return tells && message.detail.find(words, at) != std::string::npos;
  };
  heard_ = message.utime;
  words_ = message.detail.substr(0, message.detail.find("; "));
  const std::string state = words_.substr(0, words_.find(": "));
  armed_ = says(", armed, ");
  obeys_ = state == "flying" && armed_;
  if (tells) on_ground_ = says(", on ground");
  disarmed_ = says(", disarmed, on ground") ? std::optional(heard_) : std::nullopt;
  handed_over_ = std::find(kNotOurs.begin(), kNotOurs.end(), state) != kNotOurs.end();
}

bool AutopilotState::IsOld(int64_t utime) const {
  return 1e-6 * static_cast<double>(utime - heard_) > world::kMostAge.status;
}

}  // namespace chase::bus
