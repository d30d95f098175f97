#pragma once

#include <string>
#include <vector>

namespace chase::bus {

/// One row per channel: its name, its message type and who sends it.
struct ChannelRow {
  std::string channel, type, sender;
  bool heavy;  ///< stays on the host
};

/// Every channel but the <NAME>_STATUS ones (status_t).
const std::vector<ChannelRow>& ChannelTable();
bool IsHeavy(const std::string& channel);
/// "planning" -> "PLANNING_STATUS".
std::string StatusChannel(const std::string& process);

}  // namespace chase::bus
