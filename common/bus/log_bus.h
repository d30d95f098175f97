#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/bus/bus.h"
#include "common/bus/log_reader.h"
#include "common/bus/log_writer.h"
#include "common/bus/node.h"

namespace chase::bus {

/// The vehicle whose messages the log holds, which is the prefix of their channels. Throws
/// std::runtime_error with one line where there are several.
std::string VehicleIn(const std::string& log);

/// Who `process` of `vehicle` was when the log was recorded, read off the first message that it
/// sent; where the log holds none: started at 0.
Identity IdentityIn(const std::string& log, const std::string& process,
                    const std::string& vehicle = "");

/// `version` of the first status of that process in the log; empty where it holds none.
std::string VersionIn(const std::string& log, const std::string& process,
                      const std::string& vehicle = "");

/// Replays a log file to one node in the order in which it heard the messages (heard_order.h); what
/// the node sends goes to another log file with the stamp of the event that it answers. In both the
/// vehicle of its identity, the prefix, stands before the channels' names.
class LogBus : public Bus {
 public:
  /// Throws std::runtime_error when a file cannot be opened.
  LogBus(const std::string& in, const std::string& out);

  /// Drives `node` through the whole log; ticks it where it was ticked in flight, or at multiples
  /// of its period where the log does not tell. After each event `after` is called with its time,
  /// microseconds, where given. Throws std::runtime_error when the log cannot be read or holds
  /// nothing for the node, and when the node hears nothing.
  void Run(Node* node, const std::function<void(int64_t utime)>& after = nullptr);

  int64_t Now() const override { return now_; }
  int64_t events() const { return events_; }
  /// After Run: a line for each channel of which the log lacks what was heard, or the reverse; for
  /// what is damaged; and for the channels of which it holds nothing.
  const std::vector<std::string>& shortfalls() const { return shortfalls_; }

 protected:
  void SubscribeRaw(const std::string& channel, RawHandler handler) override;
  void PublishRaw(const std::string& channel, Bytes bytes) override;

 private:
  using After = std::function<void(int64_t utime)>;
  void Hand(const LogEvent& event, Node* node, const After& after);
  void TickAt(int64_t utime, Node* node);

  std::string in_;
  LogWriter out_;
  std::map<std::string, RawHandler> handlers_;
  int64_t now_ = 0, next_tick_ = -1;
  int64_t events_ = 0;
  std::set<std::string> heard_;
  bool reorders_ = false, has_ticks_ = false;
  std::vector<std::string> shortfalls_;
};

}  // namespace chase::bus
