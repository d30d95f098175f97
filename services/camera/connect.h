#pragma once

#include <netdb.h>

#include <string>

namespace chase::camera {

/// A socket connected to the first address of the list that answers within `patience_ms` each; -1
/// and in `why` what the last one says when none does.
int ConnectToAny(const addrinfo* addresses, int patience_ms, std::string* why);

}  // namespace chase::camera
