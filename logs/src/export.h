#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "common/logs/foxglove.h"
#include "common/logs/log_reader.h"

namespace chase::logs {

/// An option that would do nothing; says in one line which, with what value, and the cure.
struct BadOption : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Lines for people about what an export leaves out or whoever reads it must know.
using Notes = std::vector<std::string>;

/// What to throw when a log holds nothing to export: BadOption when `channel` names what is not
/// there; `unreadable`: what is there and cannot be read.
[[noreturn]] void RefuseEmpty(const std::string& log, const std::string& channel,
                              const Notes& unreadable);

/// A trajectory `t x y z qx qy qz qw` (s, m, frame W), one line per message: the estimate
/// (POSE), the true body (TRUTH), or the target as perceived (TARGET, where its mean is usable; no
/// rotation); a vehicle's prefix may stand before the channel's name. Returns the number of lines.
/// Throws BadOption for other channels, std::runtime_error with one line when there is no such
/// message, or several vehicles' are.
long ExportTum(const std::string& log, const std::string& out, const std::string& channel = "POSE",
               const Watch& watch = {}, Notes* notes = nullptr);

/// One CSV file `<channel>.csv` per channel in the folder `out`. A list becomes one cell of values
/// separated by spaces. Heavy channels (clouds, images, maps) are written only when `channel` names
/// them; with `channel` nothing else is written. In long form every element has a row of its own:
/// event_utime, seq, field, index, value. Returns the number of files.
int ExportCsv(const std::string& log, const std::string& out, const std::string& channel,
              bool long_form = false, const Watch& watch = {}, Notes* notes = nullptr);

/// Every message (or those of `channel`) as protobuf in an MCAP file for Foxglove and the like
/// (foxglove.h). Returns the number of messages. Throws BadOption where no image is there for
/// `options.jpeg`, or nothing for a rig that was named; std::runtime_error with one line where a
/// channel is there of several vehicles.
long ExportMcap(const std::string& log, const std::string& out, const std::string& channel = "",
                ViewerOptions options = {}, bool rig_named = false, const Watch& watch = {},
                Notes* notes = nullptr);

}  // namespace chase::logs
