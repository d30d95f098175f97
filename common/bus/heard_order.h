#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/bus/log_reader.h"

namespace chase::bus {

/// What moved a process in a recorded flight, in its order, as far as the log can tell.
struct HeardOrder {
  struct Missing {
    int64_t count = 0, of = 0;  ///< messages that are not in the log, of those that it heard
    int64_t first_utime = 0;  ///< of its first output after one, by the log's stamps, microseconds
    int64_t lost = 0;         ///< messages that the process itself has lost: the log may hold them
  };
  struct Event {
    int64_t position;  ///< in the file; -1: a tick
    int64_t utime;     ///< the log's stamp, of a tick by the outputs around it, microseconds
  };
  std::vector<Event> events;               ///< empty: in the file's order
  std::string in_file_order;               ///< why a live log is heard so; empty: it is not
  bool has_ticks = false;                  ///< the process has named its ticks
  std::map<std::string, Missing> missing;  ///< by channel; none where nothing is
  std::vector<Damage> damage;              ///< of the log

  /// A line for the file's order, each channel and each damage, for people.
  std::vector<std::string> Sentences() const;
};

/// The order in which `process` heard the messages of `channels`, which `vehicle`, the prefix,
/// stands before in the log. In a log of a live flight every
/// message that it sent names the `seq` heard last of each channel, and its newest tick: what it
/// had heard by then comes before, the rest after. Of several messages heard between two of its own
/// the one that it answers comes last: of the channels of which there is one before each message of
/// that channel the one whose newest is, on average, the latest. A log in lockstep is in the right
/// order already. A live one is heard in the file's order where the process, or the sender of one
/// of these channels, was started anew, and where the log holds nothing that the process sent.
/// Throws std::runtime_error when the log cannot be read.
HeardOrder OrderHeard(const std::string& log, const std::string& process,
                      const std::set<std::string>& channels, const std::string& vehicle = "");

}  // namespace chase::bus
