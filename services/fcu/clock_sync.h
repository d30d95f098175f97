#pragma once

#include <cstdint>
#include <deque>
#include <optional>

namespace chase::fcu {

/// The autopilot's clock on the host's, from round trips of TIMESYNC
/// (mavlink.io/en/services/timesync.html). A trip's offset errs by at most half of what the trip
/// took longer than the way itself; so the quickest trips of a window speak, as in NTP's clock
/// filter (RFC 5905, section 10). Times in microseconds.
class ClockSync {
 public:
  /// A trip sent and received at these times of the host, answered at `remote` of the autopilot.
  /// One that took longer than a second, or came before it was sent, is left out.
  void Add(int64_t sent, int64_t remote, int64_t received);

  /// The host's time of one of the autopilot; none before kLeast trips.
  std::optional<int64_t> HostTime(int64_t remote) const;

  bool synced() const { return trips_.size() >= kLeast; }
  /// Synced, and the last trip agrees.
  bool settled() const { return synced() && outliers_.empty(); }
  /// Root mean square of the quick half's offsets about the one in use, s.
  double jitter() const { return jitter_; }
  /// Of the quickest trip in the window, s.
  double round_trip() const { return round_trip_; }
  /// How often the autopilot's clock began anew.
  int restarts() const { return restarts_; }

 private:
  struct Trip {
    int64_t offset, duration, received;
  };
  void Settle();

  static constexpr std::size_t kLeast = 5;
  std::deque<Trip> trips_;     // of the window, oldest first
  std::deque<Trip> outliers_;  // in a row since the last of them
  int64_t offset_ = 0;         // host minus autopilot
  double jitter_ = 0, round_trip_ = 0;
  int restarts_ = 0;
};

}  // namespace chase::fcu
