#pragma once

#include <string>

#include "logs/src/identification.h"

namespace chase::logs {

/// Sets in the folder's control.yaml, planning.yaml and fcu.yaml what the flight shows; all other
/// lines stay. A file that is not there begins empty. `flown_by`: `cksum` of the fcu's
/// configuration in flight; empty: chase-fcu did not fly it, and fcu.yaml stays. Returns lines that
/// say what has changed. Throws std::runtime_error with one line, and nothing is written, where the
/// flight shows nothing, where fcu.yaml is not what it was flown by, and where a file cannot be
/// read or written.
std::string UpdateFiles(const Identification& identified, const std::string& flown_by,
                        const std::string& folder);

}  // namespace chase::logs
