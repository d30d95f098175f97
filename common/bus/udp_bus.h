#pragma once

#include <deque>
#include <lcm/lcm-cpp.hpp>
#include <memory>
#include <string>

#include "common/bus/bus.h"
#include "common/bus/default_url.h"
#include "common/bus/live_faults.h"
#include "common/bus/seal.h"

namespace chase::bus {

/// Messages over LCM's UDP multicast. Every channel name gets `prefix` in front. With a key light
/// messages are sealed, and those that are not are refused as a stranger's; heavy ones, which stay
/// on the host, have no seal. Where the environment holds kFaultsVariable, a seed, it also hears
/// FAULT, and delays and losses of a test flight strike what is subscribed to; SubscribeEvery's
/// messages, the record of what was sent, they spare.
class UdpBus : public Bus {
 public:
  static constexpr char kFaultsVariable[] = "CHASE_BUS_FAULTS";

  /// Throws std::runtime_error, one line with the cure, when the bus does not carry messages.
  UdpBus(const std::string& url, const std::string& prefix, const Seal& seal = Seal());

  /// Waits at most `timeout_us` for messages and hands over those that are there, and those that
  /// were delayed until then.
  void Handle(int64_t timeout_us);

  /// The host's clock: the wall clock as it was when the host's first process started, plus the
  /// steady time since. A step of the wall clock (NTP) neither holds up ticks and signs of life nor
  /// makes stamps jump in mid flight, and a process that starts again goes by the same clock.
  int64_t Now() const override;

  void SubscribeEvery(const EveryHandler& handler) override;

 protected:
  void SubscribeRaw(const std::string& channel, RawHandler handler) override;
  void PublishRaw(const std::string& channel, Bytes bytes) override;

 private:
  struct Subscription {
    UdpBus* bus;
    std::string channel;
    RawHandler handler;
    Heard heard;
  };
  struct Delayed {
    Subscription* to;
    Bytes bytes;
  };
  static void Deliver(const lcm::ReceiveBuffer* buffer, const std::string& channel,
                      Subscription* subscription);
  void HearFaults(uint64_t seed);
  void HandOver(Subscription* to, const uint8_t* data, size_t size);
  void HandOverDelayed();
  /// Size of a message without its seal; nothing, and counted, where that is not ours or has come
  /// before.
  std::optional<size_t> Opened(const std::string& channel, const uint8_t* data, size_t size,
                               Heard* heard);
  static void ForwardEvery(const lcm::ReceiveBuffer* buffer, const std::string& channel,
                           UdpBus* bus);

  lcm::LCM lcm_;
  std::string prefix_;
  int64_t clock_offset_;  // us from the steady clock to the wall clock
  Seal seal_;
  std::deque<Subscription> subscriptions_;  // addresses stay
  LiveFaults faults_;
  std::multimap<int64_t, Delayed> delayed_;  // by the time at which it is handed over, us
  EveryHandler every_;
  std::map<std::string, Heard> every_heard_;  // by channel
  int64_t every_arrived_ = 0;                 // the newest of them, us
};

}  // namespace chase::bus
