#pragma once

#include <string>

namespace chase::bus {

/// Sends one small LCM packet to the group of a udpm:// URL and waits for it to come back. Returns
/// an empty string if it does or if the URL is of another kind, else one line with the cure.
std::string LoopbackProblem(const std::string& url);
/// Such a packet's channel, or that of LCM's own test: nothing that anybody says.
bool IsLoopback(const std::string& channel);

}  // namespace chase::bus
