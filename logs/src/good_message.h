#pragma once

#include <string>

#include "common/bus/validation.h"
#include "common/logs/log_reader.h"
#include "common/logs/message_types.h"

namespace chase::logs {

/// Whether an event came on the channel; a vehicle's prefix may stand before its name.
inline bool IsOn(const LogEvent& e, const std::string& name) {
  return e.channel.size() >= name.size() &&
         e.channel.compare(e.channel.size() - name.size(), name.size(), name) == 0;
}

/// The same, and its message decodes and is sound.
template <class T>
bool Good(const LogEvent& e, const std::string& name, T* message) {
  return IsOn(e, name) && DecodeBytes(e.bytes, message) && bus::Problem(*message).empty();
}

}  // namespace chase::logs
