#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <queue>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/bus.h"
#include "common/bus/log_writer.h"
#include "common/bus/node.h"
#include "common/bus/status.h"
#include "common/world/random.h"

namespace chase::bus {

/// Runs nodes of several processes in one thread and in logical time: what a process sends arrives
/// everywhere its latency later. Events at the same time keep the order in which they were sent.
class Lockstep {
 public:
  using MakeNode = std::function<std::unique_ptr<Node>(Bus&)>;
  using Tap = std::function<void(int64_t utime, const std::string& channel, const Bus::Bytes&)>;

  /// Logical time starts at `start_utime`, microseconds.
  explicit Lockstep(int64_t start_utime) : now_(start_utime) {}

  /// Adds a process whose messages take `latency_us` from the event that it answers. `make` is
  /// called again when it is started anew. `configuration`: what --dump-config of the process
  /// prints, for its status; empty: that tells none.
  void Add(const std::string& name, int64_t latency_us, const MakeNode& make,
           const std::string& configuration = "");

  /// Sees every message when it is delivered, before the processes do.
  void SetTap(Tap tap) { tap_ = std::move(tap); }

  /// Handles everything up to and including `utime`.
  void RunUntil(int64_t utime);

  /// Calls `call` when logical time is `utime`, microseconds.
  void At(int64_t utime, std::function<void()> call) { Call(utime, std::move(call)); }

  /// A process dies as by SIGKILL, and comes up as a new one of the same configuration would: fresh
  /// state, seq from 0. What it sent before still arrives; what arrives while it is dead is lost to
  /// it. Killing a dead process or starting a live one does nothing.
  void Kill(const std::string& name);
  void Start(const std::string& name);

  /// SIGSTOP and SIGCONT: nothing is handled and no tick comes until the thaw, when the messages
  /// that found room (live_loop.h) are handled in the order in which they came, and ticks are
  /// caught up by the rules of the live loop. A stopped or dead process cannot be stopped.
  void Freeze(const std::string& name);
  void Thaw(const std::string& name);

  /// What is sent on the channel from now on arrives this much later, microseconds. Nothing holds
  /// what comes after back: when the delay ends, messages overtake.
  void SetDelay(const std::string& channel, int64_t us) { delays_[channel] = us; }

  /// Each process misses this share of what is sent, each message by a draw of its own from the
  /// seed. The tap sees all of it.
  void SetLoss(double share, uint64_t seed);

  /// A busy processor: what every process sends takes `times` its latency from now on.
  void SetLoad(double times) { load_ = times; }

  /// Sends bytes as they are, which need be no message.
  void Inject(const std::string& channel, Bus::Bytes bytes) {
    Send(now_, channel, std::move(bytes));
  }

  /// A sender beside the processes; what it publishes arrives at once.
  std::unique_ptr<Bus> Connect();

  int64_t now() const { return now_; }
  bool Done() const;

  /// Measured while running; differs from run to run.
  struct Usage {
    double cpu_s = 0.0;
    std::map<std::string, StageClock::Summary> stages;
  };
  std::map<std::string, Usage> Usages() const;  // stages: of the newest life
  const Bus& bus(const std::string& name) const;

 private:
  class Port;
  struct Life;
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

  void Send(int64_t utime, const std::string& channel, Bus::Bytes bytes);
  void Call(int64_t utime, std::function<void()> call);
  Process& Find(const std::string& name) const;
  void Begin(Process* process);
  void Schedule(Process* process, int64_t utime, void (Lockstep::*work)(Process*));
  void TickOnce(Process* process);
  void Tick(Process* process);
  void Status(Process* process);
  void Handle(Process* process, const Event& event);
  void CatchUp(Process* process);
  void Deliver(const Event& event);

  int64_t now_;
  int64_t order_ = 0;
  std::vector<std::shared_ptr<Process>> processes_;  // shared with the scheduled calls
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
  Tap tap_;
  std::map<std::string, int64_t> delays_;  // us
  double load_ = 1.0;                      // of the latencies
  double wall_s_ = 0.0, cpu_s_ = 0.0;      // spent in RunUntil()
  double loss_ = 0.0;
  world::Random loss_draws_{0};
};

}  // namespace chase::bus
