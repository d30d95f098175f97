#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "chase/camera_image_t.hpp"
#include "chase/health_t.hpp"
#include "chase/scan_registered_t.hpp"
#include "common/bus/bus.h"
#include "common/bus/node.h"
#include "services/viewer/commander.h"
#include "services/viewer/foxglove_feed.h"
#include "services/viewer/history.h"
#include "services/viewer/messages.h"
#include "services/viewer/server.h"
#include "services/viewer/viewer_config.h"

namespace chase::viewer {

/// Gathers the newest of every channel and tells it to the pages, ten times a second, and to
/// Foxglove.
class ViewerNode : public bus::Node {
 public:
  /// `source`: name of the log that is played; empty when live.
  ViewerNode(bus::Bus& bus, const ViewerConfig& config, const std::string& source = "");

  int64_t TickPeriod() const override { return 100000; }
  void Tick(int64_t utime) override;
  bus::NodeReport Report() const override;

  /// For a player: hears what pages ask of it, says where it is, and takes the scene back.
  void OnPlayRequest(std::function<void(const Request&)> handler) { on_play_ = std::move(handler); }
  void SetPlay(const PlayState& play) { play_ = play; }
  void SetStart(int64_t utime) { start_ = utime; }
  void Forget();
  /// Adds the scene as it is to the history; Tick does so when live.
  void Remember(int64_t utime);
  /// Tells the history to pages that come from now on.
  void SendHello();
  int port() const { return server_.port(); }

 private:
  void SubscribeScene();
  void SubscribeMission();
  void SubscribeStatuses();
  void SubscribeOthers();
  void OnPose(const pose_t& m);
  void OnScan(const scan_registered_t& m);
  void OnImage(const camera_image_t& m);
  void OnStatus(const status_t& m);
  void OnFlightState(const flight_state_t& m);
  /// Is a heavy part wanted and due? Then it counts as sent.
  bool Due(Part part, int64_t utime, double rate_hz);
  void Answer(const std::string& command, const std::string& refusal, const std::string& words);
  void SendHealth();
  /// Of a message: s from the first one's time.
  double Time(int64_t utime);
  /// Of a tick: s from the first one's, or from the log's beginning.
  double Elapsed(int64_t utime);

  bus::Bus& bus_;
  ViewerConfig config_;
  std::string source_;
  Server server_;
  FoxgloveFeed foxglove_;
  Commander commander_;
  std::function<void(const Request&)> on_play_;
  std::optional<PlayState> play_;

  int64_t origin_ = 0;                         // utime of the first message; 0: none yet
  int64_t newest_ = 0;                         // utime of the newest pose or plan
  int64_t start_ = -1;                         // of the first tick
  int64_t pose_heard_ = 0, flight_heard_ = 0;  // when, by the bus's clock
  std::map<std::string, int64_t> status_heard_;
  int generation_ = 0;  // of what a page has drawn and must clear
  int epoch_ = -1;      // of the frame W
  Scene scene_;
  std::vector<world::Obstacle> obstacles_;
  bool obstacles_sent_ = true;
  History history_;
  std::map<std::string, status_t> statuses_;
  std::map<std::string, ProcessHealth> health_;
  std::optional<health_t> mission_health_;
  std::map<Part, int64_t> sent_;  // utime of the last one
  int64_t ticks_ = 0;
};

}  // namespace chase::viewer
