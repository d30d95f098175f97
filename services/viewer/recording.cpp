#include "services/viewer/recording.h"

#include <algorithm>

#include "services/viewer/log_player.h"
#include "services/viewer/page_feed.h"
#include "services/viewer/shown_channels.h"

namespace chase::viewer {
namespace {

constexpr double kMostStates = 1200, kMostImages = 200, kMostSweeps = 100;
constexpr double kShortest = 0.1;  // s between states, as live
constexpr double kHighest = 2.0;   // Hz of images and sweeps

class RecordingSink : public PageSink {
 public:
  void Send(Part part, std::string bytes, bool /*binary*/) override {
    if (recorded) recording.frames.push_back({part, t, std::move(bytes)});
  }
  void Retain(Part part, std::string bytes) override {
    if (part == Part::kHello) recording.hello = std::move(bytes);
  }
  bool Wanted(Part /*part*/) const override { return recorded; }

  Recording recording;
  bool recorded = false;
  double t = 0.0;
};

ViewerConfig ConfigFor(double duration) {
  ViewerConfig config;
  config.cloud_rate_hz = std::min(kHighest, kMostSweeps / duration);
  config.image_rate_hz = std::min(kHighest, kMostImages / duration);
  return config;
}

}  // namespace

Recording RecordLog(const std::string& log) {
  LogPlayer player(log);
  const double duration = std::max(1e-6 * static_cast<double>(player.end() - player.begin()), 1.0);
  RecordingSink sink;
  PageFeed feed(player, sink, ConfigFor(duration), player.Title());
  const auto hear = [&feed](const char* channel, const auto& m) {
    if (IsOnPage(channel)) feed.Take(m);
  };
  SubscribeShown(player, hear);
  SubscribeUnknown(player, hear);
  const auto step = static_cast<int64_t>(1e6 * std::max(kShortest, duration / kMostStates));
  feed.SetStart(player.begin());
  player.Survey(step, [&feed](int64_t utime) {
    feed.Remember(utime);
    return true;
  });
  feed.Forget();
  player.Seek(player.begin() - 1);
  sink.recorded = true;
  for (int64_t utime = player.begin(); utime < player.end() + step; utime += step) {
    sink.t = 1e-6 * static_cast<double>(utime - player.begin());
    player.PlayTo(utime);
    feed.SetPlay({sink.t, duration, 1.0, true});
    feed.Tick(utime, "");
  }
  feed.SendHello();
  sink.recording.duration = duration;
  return std::move(sink.recording);
}

}  // namespace chase::viewer
