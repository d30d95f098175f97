#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/logs/log_clock.h"
#include "common/logs/log_reader.h"
#include "logs/src/info.h"
#include "logs/src/seq_count.h"

namespace chase::logs {

/// Gathers what a log is made of, event by event.
class LogSurvey {
 public:
  void Add(const LogEvent& event);
  /// `log` has been read to its end.
  LogInfo Take(const LogReader& log);
  const LogClock& clock() const { return clock_; }

 private:
  struct Channel {
    ChannelInfo info;
    int64_t previous = 0;
    std::map<std::tuple<std::string, std::string, int64_t>, std::pair<long, SeqCount>> senders;
  };
  struct Heard {
    int32_t first, last;
  };
  void AddHead(const LogEvent& event, Channel* channel);
  void AddContent(const LogEvent& event, const std::string& type);
  void NoteGap(int64_t until, Channel* channel) const;
  void Settle(Channel* channel) const;
  void AddUnrecorded(LogInfo* info) const;

  int64_t first_utime_ = INT64_MAX, last_utime_ = INT64_MIN;
  LogClock clock_;
  std::map<std::string, Channel> channels_;
  std::map<std::string, Heard> heard_;               ///< lowest and highest `seq` that others heard
  std::map<std::string, std::set<int64_t>> starts_;  ///< of processes, by name
  LogInfo info_;
};

}  // namespace chase::logs
