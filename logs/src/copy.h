#pragma once

#include <limits>
#include <map>
#include <string>
#include <vector>

#include "common/logs/log_reader.h"

namespace chase::logs {

/// Which messages of a log are copied.
struct Selection {
  double from = 0.0;                                    ///< s after the log's first event
  double to = std::numeric_limits<double>::infinity();  ///< s, not itself included
  std::vector<std::string> keep, drop;  ///< shell patterns for channels; no `keep`: all
};

/// What became of the messages. Damaged stretches are the reader's to tell.
struct Copied {
  long written = 0, read = 0;
  std::map<std::string, long> malformed;  ///< left out, by channel
  long repeated = 0;                      ///< left out: another log had them already
};

/// Writes the messages of `in` that are selected, as they are. Throws BadOption when nothing is, or
/// when a pattern fits no channel; std::runtime_error when a file cannot be read or written.
Copied CopySelected(const std::string& in, const std::string& out, const Selection& selection,
                    const Watch& watch = {});

/// Writes all that can be read: leaves out what is of our types and does not decode.
Copied Repair(const std::string& in, const std::string& out, const Watch& watch = {});

/// Writes the messages of all logs in the order of their stamps, a message that several of them
/// hold (same channel, sender and `seq`) once.
Copied Merge(const std::vector<std::string>& in, const std::string& out, const Watch& watch = {});

/// A line or more, for people.
std::string Format(const Copied& copied);

}  // namespace chase::logs
