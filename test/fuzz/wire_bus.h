#pragma once

#include <map>
#include <string>

#include "common/bus/bus.h"
#include "common/bus/channels.h"

namespace chase::fuzz {

/// A bus whose wire and clock the target holds in its hand.
class WireBus : public bus::Bus {
 public:
  int64_t Now() const override { return now; }
  bool Deliver(const std::string& channel, const uint8_t* data, size_t size) {
    const auto handler = handlers_.find(channel);
    if (handler == handlers_.end()) return false;
    handler->second(data, size);
    return true;
  }

  int64_t now = 0;  // us

 protected:
  void SubscribeRaw(const std::string& channel, RawHandler handler) override {
    handlers_[channel] = std::move(handler);
  }
  void PublishRaw(const std::string&, Bytes) override {}

 private:
  std::map<std::string, RawHandler> handlers_;
};

/// A channel for a type: the first of the table, for status_t that of planning.
inline std::string ChannelOf(const std::string& type) {
  for (const auto& row : bus::ChannelTable())
    if (row.type == type) return row.channel;
  return bus::StatusChannel("planning");
}

}  // namespace chase::fuzz
