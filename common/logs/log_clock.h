#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "common/bus/message_head.h"
#include "common/logs/log_reader.h"

namespace chase::logs {

/// Somebody set the clock that the log is stamped by: what follows is `by` later, microseconds.
struct ClockStep {
  int64_t by = 0;
  int64_t at = 0;  ///< after the log's first event
};

/// Tells times of a log as if nobody had set the clock that it is stamped by. Steps by at most 2 s
/// ahead or 0.3 s back are not told from pauses.
class LogClock {
 public:
  /// Takes the log's next event and returns when it was logged, microseconds.
  int64_t Add(const LogEvent& event);
  int64_t now() const { return now_; }  ///< of the last event
  /// By how much the clock had been set when a message of the last event was stamped: it may have
  /// been sent before the clock was set and logged after it, 2 s at most.
  int64_t SetBy(int64_t utime) const;
  int64_t Settled(int64_t utime) const { return utime - SetBy(utime); }
  const std::vector<ClockStep>& steps() const { return steps_; }
  /// The median between two events of a channel, microseconds; 0: too few to tell.
  int64_t Period(const std::string& channel) const;

 private:
  struct Channel {
    int64_t previous = 0;
    std::vector<int64_t> periods;
    std::map<std::tuple<std::string, std::string, int64_t>, int32_t> seqs;  ///< by sender, the last
  };
  enum class Jump { kNone, kStep, kPause, kPerhaps };
  static int64_t Median(const Channel& channel);
  Jump JumpOf(int64_t utime, const bus::MessageHead& head, const Channel& channel) const;
  int64_t Settle(int64_t utime, Jump jump);

  int64_t first_ = INT64_MAX, now_ = 0;
  std::optional<int64_t> sure_;       ///< the last of a message of ours
  int unsure_ = 0;                    ///< events since a jump that nobody could tell of yet
  int64_t set_ = 0, set_before_ = 0;  ///< in all; by the step before
  int64_t perhaps_ = 0;               ///< and by the jump that nobody could tell of yet
  std::vector<ClockStep> steps_;
  std::map<std::string, Channel> channels_;
};

}  // namespace chase::logs
