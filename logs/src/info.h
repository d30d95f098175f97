#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace chase::logs {

struct ChannelInfo {
  std::string channel, type;  ///< type: empty when not ours
  long count = 0;
  int64_t bytes = 0;
  int64_t first_utime = 0, last_utime = 0;  ///< of the events, microseconds

  /// Messages a second between the first and the last; 0 for a single one.
  double RateHz() const;
};

struct LogInfo {
  std::vector<ChannelInfo> channels;  ///< by name
  int64_t unread_bytes = 0;
};

LogInfo Describe(const std::string& file);

/// A table of one line per channel, for people.
std::string Format(const LogInfo& info);

}  // namespace chase::logs
