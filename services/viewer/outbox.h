#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>

namespace chase::viewer {

/// What goes to one client in one piece. Frames of the same key replace each other when the client
/// is slow: the newest counts.
struct Frame {
  int key = 0;  ///< negative: of those that are dropped last
  std::shared_ptr<const std::string> bytes;
  bool binary = false;
};

struct OutboxLimits {
  int depth = 1;              ///< frames of one key that wait; the oldest goes when there are more
  size_t waiting = 4000000;   ///< bytes that wait; the oldest frames go
  size_t unacknowledged = 0;  ///< bytes that may be under way; 0: the client does not acknowledge
};

/// The queue of one client. It is bounded, whatever the client does.
class Outbox {
 public:
  explicit Outbox(const OutboxLimits& limits) : limits_(limits) {}

  void Push(Frame frame);
  /// The frame to send now; nothing when none waits or too much is under way.
  std::optional<Frame> Next();
  /// The client has taken this many more frames.
  void Acknowledge(int64_t frames);

  size_t waiting() const { return waiting_; }  ///< bytes
  int64_t dropped() const { return dropped_; }

 private:
  void Drop(const std::deque<Frame>::const_iterator& frame);

  OutboxLimits limits_;
  std::deque<Frame> frames_;      // in the order of their first arrival
  std::deque<size_t> under_way_;  // sizes of the frames sent and not acknowledged
  size_t waiting_ = 0, under_way_bytes_ = 0;
  int64_t dropped_ = 0;
};

}  // namespace chase::viewer
