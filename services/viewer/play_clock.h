#pragma once

#include <algorithm>
#include <cmath>

namespace chase::viewer {

/// Time of a log that is played.
class PlayClock {
 public:
  static constexpr double kSlowest = 0.1, kFastest = 10.0;

  explicit PlayClock(double duration) : duration_(std::max(duration, 0.0)) {}

  /// `elapsed`: seconds on the wall. It stops at the end.
  void Advance(double elapsed) {
    if (!playing_) return;
    t_ = std::min(t_ + speed_ * std::max(elapsed, 0.0), duration_);
    if (t_ >= duration_) playing_ = false;
  }
  void Seek(double t) {
    if (std::isfinite(t)) t_ = std::clamp(t, 0.0, duration_);
  }
  void SetSpeed(double speed) {
    if (std::isfinite(speed)) speed_ = std::clamp(speed, kSlowest, kFastest);
  }
  /// At the end playing begins anew.
  void Play(bool playing) {
    if (playing && t_ >= duration_) t_ = 0.0;
    playing_ = playing;
  }

  double t() const { return t_; }  ///< s from the log's beginning
  double duration() const { return duration_; }
  double speed() const { return speed_; }  ///< log's seconds per second
  bool playing() const { return playing_; }

 private:
  double duration_, t_ = 0.0, speed_ = 1.0;
  bool playing_ = true;
};

}  // namespace chase::viewer
