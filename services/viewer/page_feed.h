#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "chase/camera_image_t.hpp"
#include "chase/event_t.hpp"
#include "chase/health_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "chase/scan_registered_t.hpp"
#include "chase/tracking_t.hpp"
#include "chase/truth_t.hpp"
#include "common/bus/bus.h"
#include "services/viewer/history.h"
#include "services/viewer/messages.h"
#include "services/viewer/page_sink.h"
#include "services/viewer/page_text.h"
#include "services/viewer/viewer_config.h"

namespace chase::viewer {

/// Gathers the newest of every channel and tells it to the pages, ten times a second. It neither
/// knows who listens nor whether the flight is live.
class PageFeed {
 public:
  /// `source`: name of the log that is played; empty when live.
  PageFeed(bus::Bus& bus, PageSink& sink, const ViewerConfig& config, const std::string& source);

  void Take(const pose_t& m);
  void Take(const target_t& m);
  void Take(const plan_t& m);
  void Take(const prediction_t& m);
  void Take(const obstacles_t& m);
  void Take(const tracking_t& m);
  void Take(const scan_registered_t& m);
  /// Shown where it was measured, in frame L, as long as no pose says where that is.
  void Take(const lidar_scan_t& m);
  /// Held back until the TARGET of its time, or a later one, is there; until the next image is due
  /// or kMostShownAge.target has passed at most, and then shown without.
  void Take(const camera_image_t& m);
  void Take(const flight_state_t& m);
  void Take(const geofence_t& m) { scene_.fence = FromMessage(m); }
  void Take(const health_t& m) { mission_health_ = m; }
  void Take(const status_t& m);
  /// Faults that a test flight did to itself; they last until the log says that they ended.
  void Take(const event_t& m);
  /// Of simulations; in their frame W, which is that of the first poses.
  void Take(const truth_t& m) { scene_.truth = FromMessage(m); }
  /// What no page shows.
  template <class T>
  void Take(const T&) {}

  /// `self`: the viewer's own sentence.
  void Tick(int64_t utime, const std::string& self);
  void SetPlay(const PlayState& play) { play_ = play; }
  void SetStart(int64_t utime) { start_ = utime; }
  /// Takes the scene back, as before a seek.
  void Forget();
  /// Adds the scene as it is to the history; Tick does so when live.
  void Remember(int64_t utime);
  /// Tells the history to pages that come from now on.
  void SendHello();

 private:
  /// Is a heavy part wanted and due? Then it counts as sent.
  bool Due(Part part, int64_t utime, double rate_hz);
  template <class Sweep>
  void SendCloud(const Sweep& m, const Eigen::Vector3d& centre);
  /// Sends the image that waits, with the target where TARGET is of its time.
  void SendImage();
  std::vector<ProcessHealth> Processes();
  /// Writes into the scene how old its inputs are now.
  void Age();
  /// Of a message: s from the first one's time.
  double Time(int64_t utime);
  /// Of a tick: s from the first one's, or from the log's beginning.
  double Elapsed(int64_t utime);

  bus::Bus& bus_;
  PageSink& sink_;
  ViewerConfig config_;
  std::string source_;
  std::optional<PlayState> play_;

  int64_t origin_ = 0;  // utime of the first message; 0: none yet
  int64_t newest_ = 0;  // utime of the newest pose or obstacles
  int64_t start_ = -1;  // of the first tick
  struct {
    int64_t pose, target, plan, forecast, obstacles, flight, tracking, image;
  } heard_{};  // when, by the bus's clock
  std::map<std::string, int64_t> status_heard_;
  int generation_ = 0;  // of what a page has drawn and must clear
  int epoch_ = -1;      // of the frame W
  int first_epoch_ = -1;
  Scene scene_;
  std::vector<world::Obstacle> obstacles_;
  bool obstacles_sent_ = true;
  History history_;
  std::map<std::string, status_t> statuses_;
  std::map<std::string, ProcessHealth> health_;
  std::optional<health_t> mission_health_;
  std::map<Part, int64_t> sent_;  // utime of the last one
  struct Image {
    int64_t utime, heard;  // its own; by the bus's clock
    int width, height;
    std::string jpeg;
  };
  std::optional<Image> image_;  // waits for the TARGET of its time
  int64_t target_utime_ = -1;   // of the newest TARGET
  int64_t ticks_ = 0;
};

}  // namespace chase::viewer
