#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <queue>
#include <string>
#include <vector>

#include "common/bus/bus.h"
#include "common/bus/log_writer.h"
#include "common/bus/node.h"
#include "common/bus/status.h"

namespace chase::bus {

/// Runs nodes of several processes in one thread and in logical time: what a process sends arrives
/// everywhere its latency later. Events at the same time keep the order in which they were sent.
class Lockstep {
 public:
  using MakeNode = std::function<std::unique_ptr<Node>(Bus&)>;
  using Tap = std::function<void(int64_t utime, const std::string& channel, const Bus::Bytes&)>;

  /// Logical time starts at `start_utime`, microseconds.
  explicit Lockstep(int64_t start_utime) : now_(start_utime) {}

  /// Adds a process whose messages take `latency_us` from the event that it answers.
  void Add(const std::string& name, int64_t latency_us, const MakeNode& make);

  /// Sees every message when it is delivered, before the processes do.
  void SetTap(Tap tap) { tap_ = std::move(tap); }

  /// Handles everything up to and including `utime`.
  void RunUntil(int64_t utime);

  int64_t now() const { return now_; }
  bool Done() const;

  /// Measured while running; differs from run to run.
  struct Usage {
    double cpu_s = 0.0;
    std::map<std::string, StageClock::Summary> stages;
  };
  std::map<std::string, Usage> Usages() const;
  const Bus& bus(const std::string& name) const;

 private:
  class Port;
  struct Process;
  struct Event {
    int64_t utime;
    int64_t order;
    std::string channel;                      // empty: a call
    std::shared_ptr<const Bus::Bytes> bytes;  // shared by the receivers
    std::function<void()> call;
    bool operator>(const Event& other) const {
      return utime != other.utime ? utime > other.utime : order > other.order;
    }
  };

  void Send(int64_t utime, const std::string& channel, const Bus::Bytes& bytes);
  void Call(int64_t utime, std::function<void()> call);
  void ScheduleTick(Process* process, int64_t utime);
  void ScheduleStatus(Process* process, int64_t utime);
  void Deliver(const Event& event);

  int64_t now_;
  int64_t order_ = 0;
  std::vector<std::shared_ptr<Process>> processes_;  // shared with the scheduled calls
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
  Tap tap_;
};

}  // namespace chase::bus
