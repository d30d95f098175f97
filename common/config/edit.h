#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "common/config/config.h"

namespace chase::config {

/// A value for a key of the outermost level, or for PARENT.KEY of the one below.
struct Change {
  std::string key, value;  ///< value: YAML on one line
  std::string comment;     ///< behind it, where the line has none of its own
};

namespace detail {
std::string Edited(std::string text, const Change& change);
}  // namespace detail

/// A file's text with these values: in the key's line, below the line that has it commented out, or
/// at the end (of PARENT.KEY: behind PARENT). All other lines and a comment behind the value stay,
/// but for one that begins like the change's own up to a colon. Throws std::runtime_error with one
/// line where the text then does not load as `wanted`, as where a value takes several lines.
template <class C>
std::string Edited(std::string text, const std::string& origin, const C& wanted,
                   const std::vector<Change>& changes) {
  for (const Change& change : changes) text = detail::Edited(text, change);
  C loaded;
  try {
    LoadText(text, origin, &loaded);
  } catch (const std::runtime_error& e) {
    throw std::runtime_error(std::string(e.what()) + "; the file is left as it was");
  }
  if (Dump(loaded) != Dump(wanted))
    throw std::runtime_error(origin +
                             ": cannot be changed line by line; write a key, a colon and "
                             "its value on a line each");
  return text;
}

}  // namespace chase::config
