#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include "chase/plan_t.hpp"
#include "common/logs/foxglove.h"
#include "services/viewer/server.h"

namespace chase::viewer {

/// Turns messages into what Foxglove shows, for those channels only that somebody has subscribed
/// to. A channel is advertised with its first message.
class FoxgloveFeed {
 public:
  FoxgloveFeed(Server& server, const world::Rig& rig) : server_(server), options_{true, rig} {}

  template <class T>
  void Offer(const std::string& channel, const T& message) {
    if constexpr (std::is_same_v<T, plan_t>)
      options_.hard_radius[message.vehicle] = message.hard_radius;
    if (!Needs(channel)) return;
    std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    Convert(channel, message.utime, std::move(bytes));
  }

 private:
  bool Needs(const std::string& channel) const;
  void Convert(const std::string& channel, int64_t utime, std::vector<uint8_t> bytes);
  uint32_t IdOf(const std::string& topic, const std::string& schema);

  Server& server_;
  logs::ViewerOptions options_;
  std::map<std::string, uint32_t> ids_;                      // by topic
  std::map<std::string, std::vector<uint32_t>> of_channel_;  // what a channel's messages become
};

}  // namespace chase::viewer
