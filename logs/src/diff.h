#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/logs/log_reader.h"

namespace chase::logs {

/// How one field of a channel differs between two logs.
struct FieldDifference {
  long messages = 0;         ///< in which it differs
  double greatest = 0.0;     ///< absolute difference of numbers
  long first = 0;            ///< index of the first pair in which it differs
  std::string first_values;  ///< "1.5 against 1.7"
};

struct ChannelDifference {
  long count_a = 0, count_b = 0;
  long only_a = 0, only_b = 0;                    ///< messages that the other log lacks
  std::map<std::string, FieldDifference> fields;  ///< by path; "event_time" is the log's own stamp
};

struct Differences {
  std::map<std::string, ChannelDifference> channels;  ///< of both logs; those that differ
  std::vector<std::string> only_a, only_b;            ///< channels that the other log lacks
};

/// Compares the messages of each channel in A with the same ones in B, field by field: those of one
/// sender (and of its first, second... start) with one `seq`, or those of one `utime` where that
/// pairs more. `ignore` holds shell patterns for "CHANNEL.field", such as "*_STATUS.*";
/// "CHANNEL.count" is what one of them lacks. Numbers
/// within `tolerance` of each other, absolute below 1 and relative above, are the same. Throws
/// std::runtime_error with one line when a log cannot be read or they have no channel in common.
Differences Diff(const std::string& a, const std::string& b, const std::vector<std::string>& ignore,
                 double tolerance = 0.0, const Watch& watch = {});

/// A line for each log's own channels, one per channel and one per field that differs, for people.
std::string Format(const Differences& differences);

}  // namespace chase::logs
