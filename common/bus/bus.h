#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "chase/input_t.hpp"
#include "common/bus/stage_clock.h"
#include "common/bus/validation.h"

namespace chase::bus {

/// What a process saw on one channel.
struct ChannelCounters {
  int64_t received = 0;
  int64_t dropped = 0;
  int64_t foreign = 0;
  int64_t malformed = 0;
  int32_t last_seq = -1;
};

/// Who a process is on the bus.
struct Identity {
  std::string process, vehicle;
  int64_t start = 0;  ///< when it started, microseconds
};

/// Typed publish and subscribe; the backends carry bytes. A subscription hands over good messages
/// only: what does not decode, breaks `Problem(message)` or comes from another vehicle, or from a
/// process that has no business on the channel, is counted and left out.
class Bus {
 public:
  using Bytes = std::vector<uint8_t>;
  using RawHandler = std::function<void(const uint8_t* data, size_t size)>;

  virtual ~Bus() = default;

  /// Calls `handler` for every good message of `channel`. One handler per channel.
  template <class T>
  void Subscribe(const std::string& channel, std::function<void(const T&)> handler) {
    auto& counters = counters_[channel];
    // Every message is decoded into the same place: sweeps and images need no new memory.
    SubscribeRaw(channel, [this, channel, &counters, handler, kept = std::make_shared<T>()](
                              const uint8_t* data, size_t size) {
      T& message = *kept;
      if (!Decode(channel, data, size, &message, &counters)) return;
      Guarded(channel, [&] { handler(message); });
    });
  }

  /// What hears everything: the channel's name as on the wire, when the message came (microseconds,
  /// the bus's clock), its bytes.
  using EveryHandler = std::function<void(const std::string& channel, int64_t utime,
                                          const uint8_t* data, size_t size)>;
  /// Hands over every message of every channel of the vehicle as it came, decoded or not, beside
  /// other subscriptions; for a recorder. Gaps in each sender's `seq` are counted as drops.
  virtual void SubscribeEvery(const EveryHandler& handler);

  /// Numbers `message` (field seq), says who sends it and what had been heard by then, and sends
  /// it. The caller sets utime.
  template <class T>
  void Publish(const std::string& channel, T message) {
    message.seq = next_seq_[channel]++;
    message.sender = identity_.process;
    message.vehicle = identity_.vehicle;
    message.sender_start = identity_.start;
    message.inputs = Inputs();
    message.n_inputs = static_cast<int32_t>(message.inputs.size());
    Bytes bytes(static_cast<size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    PublishRaw(channel, std::move(bytes));
  }

  /// Before each tick of a process whose log may be replayed: what it sends from then on names the
  /// tick beside the messages that it has heard, as channel kTick.
  void CountTick() { ++ticks_; }
  static constexpr char kTick[] = "TICK";

  /// Sends a message that another process has encoded, as it is.
  void Forward(const std::string& channel, Bytes bytes) { PublishRaw(channel, std::move(bytes)); }

  /// Time of the event being handled, microseconds: logical where the backend is, else the wall's.
  virtual int64_t Now() const = 0;

  /// Measures wall time from here to the end of the returned object's life under `stage`.
  StageClock::Scope Time(const std::string& stage) { return stages_.Measure(stage); }

  /// Remembers the newest error for the status message.
  void ReportError(const std::string& what) { last_error_ = what; }

  /// Before anything is sent. A process without a name hears everybody.
  void SetIdentity(Identity identity) { identity_ = std::move(identity); }
  const Identity& identity() const { return identity_; }

  const std::map<std::string, ChannelCounters>& counters() const { return counters_; }
  const StageClock& stages() const { return stages_; }
  const std::string& last_error() const { return last_error_; }

 protected:
  virtual void SubscribeRaw(const std::string& channel, RawHandler handler) = 0;
  virtual void PublishRaw(const std::string& channel, Bytes bytes) = 0;
  /// Counts a message of any type by its head.
  void CountAny(const std::string& channel, const uint8_t* data, size_t size);
  void Guarded(const std::string& channel, const std::function<void()>& handler);
  /// Counts a message as a stranger's.
  void Refuse(const std::string& channel, const std::string& why);

 private:
  template <class T>
  bool Decode(const std::string& channel, const uint8_t* data, size_t size, T* message,
              ChannelCounters* counters) {
    std::string problem;
    try {
      if (message->decode(data, 0, static_cast<int>(size)) != static_cast<int>(size))
        problem = "does not decode";
      else
        problem = Problem(*message);
    } catch (const std::exception& e) {  // generated decoders throw on negative lengths
      problem = std::string("does not decode: ") + e.what();
    }
    if (problem.empty() && IsForeign(channel, message->sender, message->vehicle)) {
      Refuse(channel, "from " + message->sender + " of vehicle '" + message->vehicle + "'");
      return false;
    }
    return Count(channel, problem, problem.empty() ? message->seq : 0, counters);
  }

  bool Count(const std::string& channel, const std::string& problem, int32_t seq,
             ChannelCounters* counters);
  bool IsForeign(const std::string& channel, const std::string& sender,
                 const std::string& vehicle) const;
  std::vector<input_t> Inputs() const;

  Identity identity_;
  std::map<std::string, ChannelCounters> counters_;
  int32_t ticks_ = 0;
  std::map<std::string, int32_t> next_seq_;
  std::map<std::tuple<std::string, std::string, int64_t>, int32_t> last_seq_;  // of each sender
  StageClock stages_;
  std::string last_error_;
};

}  // namespace chase::bus
