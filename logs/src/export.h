#pragma once

#include <string>

namespace chase::logs {

/// POSE as a trajectory `t x y z qx qy qz qw` (s, m), one line per message. Returns their number.
/// Throws std::runtime_error with one line when there is none.
long ExportTum(const std::string& log, const std::string& out);

/// One CSV file `<channel>.csv` per channel in the folder `out`. A list becomes one cell of values
/// separated by spaces. Heavy channels (clouds, images, maps) are written only when `channel` names
/// them; with `channel` nothing else is written. Returns the number of files.
int ExportCsv(const std::string& log, const std::string& out, const std::string& channel);

/// Every message as JSON in an MCAP file for Foxglove and the like; clouds and images in Foxglove's
/// own schemas. Returns the number of messages.
long ExportMcap(const std::string& log, const std::string& out);

}  // namespace chase::logs
