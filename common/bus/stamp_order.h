#pragma once

#include <cstdint>
#include <limits>

namespace chase::bus {

/// Tells a message that comes late from a clock that was set back: what is newer than the message
/// before it, yet older than the newest stamp by more than messages are ever late, goes by another
/// clock. A clock that was set back by less catches up in that time.
class StampOrder {
 public:
  enum class Verdict { kNewer, kLate, kSetBack };
  static constexpr int64_t kLatest = 300000;  ///< us that a message is late at most

  Verdict Take(int64_t utime) {
    const bool follows = utime > previous_;
    previous_ = utime;
    if (utime > newest_) {
      newest_ = utime;
      return Verdict::kNewer;
    }
    if (!follows || newest_ - utime < kLatest) return Verdict::kLate;
    newest_ = utime;
    return Verdict::kSetBack;
  }

  /// Takes it: was something newer there before? Messages of one instant follow each other.
  bool IsOvertaken(int64_t utime) { return Take(utime) == Verdict::kLate && utime < newest_; }

  int64_t newest() const { return newest_; }

 private:
  static constexpr int64_t kNever = std::numeric_limits<int64_t>::min() / 2;
  int64_t newest_ = kNever, previous_ = kNever;
};

}  // namespace chase::bus
