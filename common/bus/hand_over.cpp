#include "common/bus/hand_over.h"

#include <algorithm>

namespace chase::bus {

std::string HandOverIn(const status_t& status) {
  if (status.name != "fcu") return "";
  // The detail begins with the hand-shake's state and why it is in it: "pilot: the mode was ...".
  static constexpr const char* kNotOurs[] = {
      "pilot: ", "failsafe: ", "landing: ", "done: ", "refused: "};
  const std::string& detail = status.detail;
  const bool handed_over =
      std::any_of(std::begin(kNotOurs), std::end(kNotOurs),
                  [&](const char* state) { return detail.rfind(state, 0) == 0; });
  return handed_over ? detail.substr(0, detail.find("; ")) : "";
}

}  // namespace chase::bus
