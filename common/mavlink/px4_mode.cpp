#include "common/mavlink/px4_mode.h"

#include <iterator>

namespace chase::mavlink {

std::string Mode::name() const {
  static const char* const mains[] = {"no mode",   "MANUAL", "ALTCTL",     "POSCTL",
                                      "AUTO",      "ACRO",   "OFFBOARD",   "STABILIZED",
                                      "RATTITUDE", "SIMPLE", "TERMINATION"};
  static const char* const autos[] = {"",    "READY", "TAKEOFF", "LOITER", "MISSION",
                                      "RTL", "LAND",  "RTGS",    "FOLLOW", "PRECLAND"};
  const std::string word =
      main < std::size(mains) ? mains[main] : "mode " + std::to_string(static_cast<int>(main));
  if (main != 4 || sub == 0) return word;
  return word + "." + (sub < std::size(autos) ? autos[sub] : std::to_string(sub));
}

}  // namespace chase::mavlink
