#pragma once

#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/bus/channels.h"
#include "common/bus/validation.h"
#include "common/logs/log_reader.h"
#include "common/logs/message_types.h"

namespace chase::logs {

/// Whether `channel` is that of the name; a vehicle's prefix may stand before it.
inline bool IsOn(const std::string& channel, const std::string& name) {
  return channel.size() >= name.size() &&
         channel.compare(channel.size() - name.size(), name.size(), name) == 0;
}
inline bool IsOn(const LogEvent& e, const std::string& name) { return IsOn(e.channel, name); }

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
