#pragma once

#include <string>

#include "common/logs/record.h"

namespace chase::logs {

/// What a new member can be made from.
struct Source {
  const std::string& channel;
  const Record& old;  ///< the struct that the member is new in, as it was recorded
};

/// Fills a member that the old version had not, or had in another form; `value` is its zero. Null
/// when zero is right. To teach another member its past, add a row to the table in the .cpp.
using Rule = void (*)(const Source& source, Value* value);
Rule RuleFor(const std::string& type, const std::string& member);

}  // namespace chase::logs
