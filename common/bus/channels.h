#pragma once

#include <string>
#include <vector>

namespace chase::bus {

/// One row per channel: its name, its message type and who sends it.
struct ChannelRow {
  std::string channel, type, sender;
  bool heavy;             ///< stays on the host
  bool commands = false;  ///< moves the vehicle
};

/// Every channel but the <NAME>_STATUS ones (status_t).
const std::vector<ChannelRow>& ChannelTable();
/// May a process of this name be obeyed on the channel? What moves the vehicle comes from the
/// processes of the table only; anybody may stand in for the others.
bool MaySend(const std::string& channel, const std::string& sender);
bool IsHeavy(const std::string& channel);
/// "planning" -> "PLANNING_STATUS".
std::string StatusChannel(const std::string& process);

}  // namespace chase::bus
