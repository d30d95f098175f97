#include "services/link/link_config.h"

namespace chase::link {

std::string LinkConfig::Problem() const {
  if (side != "vehicle" && side != "ground")
    return "side is '" + side + "'; it must be vehicle or ground";
  if (port < 1 || port > 65535)
    return "port is " + std::to_string(port) + "; it must be 1 to 65535";
  if (!(most_rate_hz >= 0.0 && most_rate_hz <= 1e4))
    return "most_rate_hz is " + std::to_string(most_rate_hz) + "; it must be 0 to 10000";
  if (side == "ground" && peer.empty())
    return "peer is empty; a ground station must name its vehicle's ADDRESS:PORT";
  return "";
}

}  // namespace chase::link
