#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/bus/bus.h"
#include "common/bus/node.h"
#include "services/viewer/commander.h"
#include "services/viewer/foxglove_feed.h"
#include "services/viewer/page_feed.h"
#include "services/viewer/server.h"
#include "services/viewer/viewer_config.h"

namespace chase::viewer {

/// Tells pages and Foxglove what is on the bus, and passes commands on.
class ViewerNode : public bus::Node {
 public:
  /// `source`: name of the log that is played; empty when live.
  ViewerNode(bus::Bus& bus, const ViewerConfig& config, const std::string& source = "");

  int64_t TickPeriod() const override { return 100000; }
  void Tick(int64_t utime) override;
  bus::NodeReport Report() const override;

  /// For a player: hears what pages have asked of it, once a tick.
  using PlayHandler = std::function<void(const std::vector<Request>&)>;
  void OnPlayRequests(PlayHandler handler) { on_play_ = std::move(handler); }
  PageFeed& feed() { return feed_; }
  int port() const { return server_.port(); }

 private:
  Server server_;
  FoxgloveFeed foxglove_;
  PageFeed feed_;
  Commander commander_;
  PlayHandler on_play_;
};

}  // namespace chase::viewer
