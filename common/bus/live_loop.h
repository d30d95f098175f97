#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "common/bus/channels.h"

/// The rules of a live process's loop, which the lockstep follows as well after a stop.
namespace chase::bus {

inline constexpr int kBurst =
    64;  // messages handled before ticks and the clock are looked at again

/// Messages of one channel that wait for a busy process; more are lost, the newest first. LCM's
/// default of 30 loses IMU samples while a process works; clouds and images are large.
inline int QueueCapacity(const std::string& channel) { return IsHeavy(channel) ? 10 : 400; }

/// What the socket of a stopped process holds of everything on the bus: the kernel doubles the
/// recv_buf_size that kDefaultUrl asks for, and counts more than the payload (measured: 832 bytes
/// for a datagram of 100). 0.3 s of sweeps and images.
inline constexpr int64_t kReceiveBuffer = 2 * 2097152, kPerMessage = 732;  // bytes

/// When a node is ticked, microseconds. A node that cannot keep up loses time, never a tick.
class TickClock {
 public:
  TickClock(int64_t period, int64_t now) : period_(period), next_(now) {}

  bool Due(int64_t now) const { return period_ > 0 && now >= next_; }
  /// Time on the clock of the next tick.
  int64_t next() const { return next_; }
  /// The due tick's own time, which never goes back.
  int64_t Take(int64_t now) {
    if (now - next_ > kMaxLag) {
      slip_ += now - next_;
      next_ = now;
    }
    const int64_t utime = next_ - slip_;
    next_ += period_;
    return utime;
  }

 private:
  static constexpr int64_t kMaxLag = 500000;  // that ticks may fall behind before time slips
  int64_t period_, next_;
  int64_t slip_ = 0;
};

}  // namespace chase::bus
