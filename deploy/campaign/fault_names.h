#pragma once

#include <string>
#include <vector>

namespace chase::campaign {

/// Every fault that chase-flight knows.
const std::vector<std::string>& FaultNames();

/// Throws std::runtime_error, one line, unless the fault is NAME or NAME@SECONDS.
void CheckFault(const std::string& fault);

}  // namespace chase::campaign
