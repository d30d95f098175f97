#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace chase::logs {

/// The whole file, unpacked when its name ends in .xz. Throws std::runtime_error with one line.
std::vector<uint8_t> ReadInput(const std::string& file);

}  // namespace chase::logs
