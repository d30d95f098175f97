#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "logs/src/log_reader.h"
#include "logs/src/seq_count.h"

namespace chase::logs {

/// The messages of one process on a channel, from its start to its end.
struct SenderInfo {
  std::string name;
  long count = 0;
  int64_t missing = 0;  ///< by `seq`
};

struct ChannelInfo {
  std::string channel, type;  ///< type: empty when not ours
  long count = 0;
  int64_t bytes = 0;
  int64_t first_utime = 0, last_utime = 0;  ///< of the events, microseconds
  int64_t longest_gap = 0;                  ///< from event to event, microseconds
  std::vector<SenderInfo> senders;
  /// 0 on a channel that others heard but that the log does not hold.
  int64_t missing = 0;

  /// Messages a second between the first and the last; 0 for a single one.
  double RateHz() const;
  double MissingShare() const;
};

struct LogInfo {
  std::string file;
  int64_t bytes = 0;
  std::vector<ChannelInfo> channels;            ///< by name
  std::map<std::string, std::string> versions;  ///< by process, of its status messages
  std::string scenario;                         ///< name and seed; empty: there is none
  std::vector<Damage> damage;

  bool Whole() const { return damage.empty(); }
  /// Whole, and no channel that figures are computed from has lost more than a hundredth: beyond
  /// that a 99th percentile says nothing. What is too heavy to be always recorded does not count.
  bool Recorded() const;
  /// A line for everything that is not there.
  std::vector<std::string> Losses() const;
};

/// Gathers what a log is made of, event by event.
class LogSurvey {
 public:
  void Add(const Event& event);
  /// `log` has been read to its end.
  LogInfo Take(const LogReader& log);

 private:
  struct Channel {
    ChannelInfo info;
    int64_t previous = 0;
    std::map<std::tuple<std::string, std::string, int64_t>, std::pair<long, SeqCount>> senders;
  };
  struct Heard {
    int32_t first, last;
  };
  void AddHead(const Event& event, Channel* channel);
  void AddContent(const Event& event, const std::string& type);
  void Settle(Channel* channel) const;
  void AddUnrecorded(LogInfo* info) const;

  int64_t first_utime_ = INT64_MAX;
  std::map<std::string, Channel> channels_;
  std::map<std::string, Heard> heard_;  ///< lowest and highest `seq` that others heard
  LogInfo info_;
};

LogInfo Describe(const std::string& file);

/// What the log is and a table of one line per channel, for people.
std::string Format(const LogInfo& info);
std::string Format(const Damage& damage);

}  // namespace chase::logs
