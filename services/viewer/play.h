#pragma once

#include <functional>
#include <string>

#include "services/viewer/viewer_config.h"

namespace chase::viewer {

/// Plays a flight log to the pages until `stop` says so; they hold the controls, all of them the
/// same. Throws std::runtime_error with one line.
void PlayLog(const std::string& file, const ViewerConfig& config,
             const std::function<bool()>& stop);

}  // namespace chase::viewer
