#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/logs/log_clock.h"
#include "common/logs/log_reader.h"

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
  long unreadable = 0;  ///< of `count`: of another version, or damaged
  int64_t bytes = 0;
  int64_t first_utime = 0, last_utime = 0;  ///< of the events, microseconds
  int64_t longest_gap = 0;                  ///< without one until the log ends, microseconds
  int64_t gap_begins = 0;                   ///< after the log's first event, microseconds
  int64_t period = 0;  ///< the median between two of them, microseconds; 0: too few to tell
  std::vector<SenderInfo> senders;
  int64_t missing = 0;        ///< by `seq`; where count is 0: what others heard of the channel
  int64_t missing_first = 0;  ///< of them: before the first message of a sender

  /// Messages a second between the first and the last; 0 for a single one.
  double RateHz() const;
  double MissingShare() const;
};

using TextByProcess = std::map<std::string, std::string>;

struct LogInfo {
  std::string file;
  int64_t bytes = 0;
  std::vector<ChannelInfo> channels;  ///< by name
  /// By process, of its status messages; hosts and configurations (`cksum` of what --dump-config
  /// prints) of live ones only.
  TextByProcess versions, hosts, configurations;
  std::string scenario;                 ///< name and seed; empty: there is none
  std::map<std::string, int> restarts;  ///< of processes that were started anew, by name
  std::vector<ClockStep> clock_steps;   ///< times above are as if there had been none
  bool heavy_left_out = false;          ///< a recorder told that its disk was nearly full
  std::vector<Damage> damage;

  /// When it begins, "2026-05-01 12:00:00"; empty: in logical time, or it holds nothing.
  std::string Utc() const;
  /// Lines of versions, hosts and configurations.
  std::vector<std::string> Software() const;
  /// The same for programs: "versions", "hosts", "configurations".
  std::map<std::string, TextByProcess> SoftwareByKind() const;
  /// Throws std::runtime_error with one line when it holds a channel of several vehicles.
  void RequireOneVehicle() const;
  bool Whole() const { return damage.empty(); }
  /// Whole, all of it can be read, and nothing is missing but of sweeps, images and maps a
  /// hundredth: beyond that a 99th percentile says nothing. A recorder drops their oldest on
  /// purpose, and leaves them out where its disk is nearly full: neither counts.
  bool Recorded() const;
  /// A line for everything that is not there or cannot be read, for a gap of ten of its channel's
  /// periods and a tenth of a second where messages are missing, and for whoever was started anew.
  std::vector<std::string> Losses() const;
};

LogInfo Describe(const std::string& file);

/// What the log is and a table of one line per channel, for people.
std::string Format(const LogInfo& info);

}  // namespace chase::logs
