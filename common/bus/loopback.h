#pragma once

#include <string>

namespace chase::bus {

/// Sends one small packet, which LCM passes over, to the group of a udpm:// URL and waits for it to
/// come back. Returns an empty string if it does or if the URL is of another kind, else one line
/// with the cure.
std::string LoopbackProblem(const std::string& url);
/// The channel of such a packet of an older version, or of LCM's own test: nothing that anybody
/// says.
bool IsLoopback(const std::string& channel);

}  // namespace chase::bus
