#pragma once

#include <string>

namespace chase::viewer {

/// The first line of a file, without the blanks at its ends. Throws std::runtime_error, one line
/// with the cure, where it cannot be read or is too short for a token.
std::string TokenIn(const std::string& file);

}  // namespace chase::viewer
