#pragma once

#include <cstdint>
#include <string>

namespace chase::config {

/// What `cksum` prints first for these bytes: POSIX.1-2017, cksum.
uint32_t Checksum(const std::string& bytes);

}  // namespace chase::config
