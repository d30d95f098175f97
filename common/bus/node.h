#pragma once

#include <cstdint>
#include <string>

namespace chase::bus {

/// What a node says of itself in its status message.
struct NodeReport {
  enum class State { kStarting, kOk, kDegraded, kFailed };
  State state = State::kOk;
  std::string detail;
  std::string phase = {};  ///< the status is sent at once when this changes, or the state
};

/// A node converts and wires. It is constructed as `SomeNode(Bus&, const SomeConfig&)`, subscribes
/// in the constructor and moves only when a message arrives or when it is ticked.
class Node {
 public:
  virtual ~Node() = default;

  /// Microseconds between ticks; 0: never ticked.
  virtual int64_t TickPeriod() const { return 0; }

  /// Called at multiples of TickPeriod() with the tick's own time, which never goes back.
  virtual void Tick(int64_t /*utime*/) {}

  /// True when a source has nothing left to give; the process then ends with exit code 0.
  virtual bool Done() const { return false; }

  virtual NodeReport Report() const { return {}; }
};

}  // namespace chase::bus
