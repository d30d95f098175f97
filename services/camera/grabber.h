#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "services/camera/frame_source.h"

namespace chase::camera {

/// Reads a device in a thread of its own, so that a frame's arrival is its own and not that of
/// whoever fetches it. Of frames that nobody has fetched the newest is kept. A source that gives
/// nothing or throws is asked again after a fifth of a second.
class Grabber {
 public:
  struct Grabbed {
    Frame frame;
    int64_t arrival = 0;  ///< on the monotonic clock, microseconds
  };

  explicit Grabber(std::unique_ptr<FrameSource> source);
  ~Grabber();
  Grabber(const Grabber&) = delete;
  Grabber& operator=(const Grabber&) = delete;

  /// The newest frame since the last call.
  std::optional<Grabbed> Take();
  /// Frames that were read and never fetched.
  long dropped() const;
  /// Frames that were no picture, or over which the source threw.
  long undecodable() const;
  /// Of the last frame; empty: none.
  std::string Problem() const;

 private:
  void Run();
  void Accept(Frame frame, int64_t arrival);

  std::unique_ptr<FrameSource> source_;
  mutable std::mutex mutex_;
  std::condition_variable stopped_;
  std::optional<Grabbed> newest_;
  std::string problem_;
  long dropped_ = 0, undecodable_ = 0;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace chase::camera
