#include "services/viewer/play.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>
#include <utility>

#include "services/viewer/log_player.h"
#include "services/viewer/play_clock.h"
#include "services/viewer/viewer_node.h"

namespace chase::viewer {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kStep = std::chrono::milliseconds(20);
constexpr auto kTick = std::chrono::milliseconds(100);

class Playback {
 public:
  Playback(const std::string& file, const ViewerConfig& config, const std::function<bool()>& stop)
      : player_(file),
        node_(player_, config, player_.Title()),
        clock_(static_cast<double>(player_.end() - player_.begin()) * 1e-6) {
    node_.feed().SetStart(player_.begin());
    player_.Survey(node_.TickPeriod(), [&](int64_t utime) {
      node_.feed().Remember(utime);
      return !stop();
    });
    node_.OnPlayRequests([this](const std::vector<Request>& requests) { Hear(requests); });
    Jump();
    node_.feed().SendHello();
  }

  void Step(double elapsed, bool tick) {
    clock_.Advance(elapsed);
    player_.PlayTo(Utime());
    if (tick) Tell();
  }
  int port() const { return node_.port(); }

 private:
  int64_t Utime() const { return player_.begin() + std::llround(clock_.t() * 1e6); }

  void Tell() {
    node_.feed().SetPlay({clock_.t(), clock_.duration(), clock_.speed(), clock_.playing()});
    node_.Tick(Utime());
    if (std::exchange(looked_at_, false) && !clock_.playing()) Jump();
  }

  /// The scene as it was at the clock's time.
  void Jump() {
    node_.feed().Forget();
    player_.Seek(Utime());
    node_.feed().SetPlay({clock_.t(), clock_.duration(), clock_.speed(), clock_.playing()});
  }

  void Hear(const std::vector<Request>& requests) {
    const double before = clock_.t();
    for (const Request& request : requests) {
      if (request.speed) clock_.SetSpeed(*request.speed);
      if (request.seek) clock_.Seek(*request.seek);
      if (request.play) clock_.Play(*request.play);
      if (request.looks) looked_at_ = true;
    }
    if (clock_.t() != before) Jump();
  }

  LogPlayer player_;
  ViewerNode node_;
  PlayClock clock_;
  bool looked_at_ = false;  ///< anew: by who lacks the moment at which the clock stands still
};

}  // namespace

void PlayLog(const std::string& file, const ViewerConfig& config,
             const std::function<bool()>& stop) {
  Playback playback(file, config, stop);
  std::printf("http://localhost:%d plays %s\n", playback.port(), file.c_str());
  std::fflush(stdout);
  auto last = Clock::now(), tick = last;
  while (!stop()) {
    std::this_thread::sleep_until(last + kStep);
    const auto now = Clock::now();
    const bool due = now >= tick;
    playback.Step(std::chrono::duration<double>(now - last).count(), due);
    if (due) tick = std::max(tick + kTick, now);
    last = now;
  }
}

}  // namespace chase::viewer
