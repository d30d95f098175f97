#pragma once

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/channels.h"
#include "common/bus/validation.h"
#include "common/logs/log_reader.h"
#include "common/logs/message_types.h"
#include "logs/src/message_fields.h"

namespace chase::logs {

/// Whether `channel` is that of the name; a vehicle's prefix may stand before it.
inline bool IsOn(const std::string& channel, const std::string& name) {
  return channel.size() >= name.size() &&
         channel.compare(channel.size() - name.size(), name.size(), name) == 0;
}
inline bool IsOn(const LogEvent& e, const std::string& name) { return IsOn(e.channel, name); }

/// Ours by its channel or its type, but no whole message of today's: of another version, or
/// damaged.
inline bool IsUnreadable(const LogEvent& e) {
  bool reads = false;
  WithMessage(e.bytes, [&](const auto&) { reads = true; });
  if (reads) return false;
  const auto& table = bus::ChannelTable();
  return !TypeOf(e.bytes).empty() || IsOn(e, "_STATUS") ||
         std::any_of(table.begin(), table.end(),
                     [&](const bus::ChannelRow& row) { return IsOn(e, row.channel); });
}

/// For people; `count` of them, on that channel.
std::string UnreadableLine(const std::string& channel, long count);

/// Counts them by channel.
class Unreadable {
 public:
  void Add(const LogEvent& e) {
    if (IsUnreadable(e)) ++counts_[e.channel];
  }
  std::vector<std::string> Lines() const {
    std::vector<std::string> lines;
    for (const auto& [channel, count] : counts_) lines.push_back(UnreadableLine(channel, count));
    return lines;
  }

 private:
  std::map<std::string, long> counts_;
};

/// The figures of one must not be those of another.
[[noreturn]] inline void RefuseSeveralVehicles(const std::string& log, const std::string& name) {
  throw std::runtime_error(log + ": holds " + name +
                           " of several vehicles; keep one with chase-log filter");
}

/// Of a log that is to be of one vehicle. Hear() throws std::runtime_error with one line at the
/// second that a channel comes from.
class OneVehicle {
 public:
  explicit OneVehicle(std::string log) : log_(std::move(log)) {}

  void Hear(const std::string& channel) {
    if (!heard_.insert(channel).second) return;
    for (const bus::ChannelRow& row : bus::ChannelTable())
      if (IsOn(channel, row.channel) && !names_.insert(row.channel).second)
        RefuseSeveralVehicles(log_, row.channel);
  }

 private:
  std::string log_;
  std::set<std::string> heard_, names_;  // with and without prefix
};

/// The same, and its message decodes and is sound.
template <class T>
bool Good(const LogEvent& e, const std::string& name, T* message) {
  return IsOn(e, name) && DecodeBytes(e.bytes, message) && bus::Problem(*message).empty();
}

}  // namespace chase::logs
