#pragma once

#include <string>

namespace chase::flight {

/// The absolute path of a scenario that is given as a file, or by its name in share/chase/scenarios
/// or its folder twelve. Throws std::runtime_error, one line, where there is neither.
std::string ScenarioFile(const std::string& scenario);

}  // namespace chase::flight
