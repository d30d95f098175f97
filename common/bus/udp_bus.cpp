#include "common/bus/udp_bus.h"

#include <fmt/format.h>
#include <poll.h>
#include <time.h>

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

#include "common/bus/channels.h"
#include "common/bus/host_clock.h"
#include "common/bus/live_loop.h"
#include "common/bus/loopback.h"

namespace chase::bus {

namespace {

constexpr int kEveryLight =
    10000;  // messages that wait for a recorder: 5 s of a flight's 2000 a second
constexpr int64_t kLongestWait = 10'000'000;  // us; beyond it the wall clock was set

/// Checked before LCM opens its sockets: LCM itself would wait ten seconds and then abort.
const std::string& Checked(const std::string& url) {
  const std::string problem = LoopbackProblem(url);
  if (!problem.empty()) throw std::runtime_error(problem);
  return url;
}

}  // namespace

UdpBus::UdpBus(const std::string& url, const std::string& prefix, const Seal& seal)
    : lcm_(Checked(url)), prefix_(prefix), clock_offset_(HostClockOffset()), seal_(seal) {
  if (!lcm_.good())
    throw std::runtime_error(fmt::format(
        "{}: LCM cannot open it; check the address and port, or run deploy/doctor", url));
  if (const char* seed = std::getenv(kFaultsVariable)) HearFaults(std::strtoull(seed, nullptr, 10));
}

/// Beside Subscribe: what a process sends names what it has heard, and this the process has not.
void UdpBus::HearFaults(uint64_t seed) {
  faults_ = LiveFaults(seed);
  UdpBus::SubscribeRaw("FAULT", [this](const uint8_t* data, size_t size) {
    Guarded("FAULT", [&] {
      event_t event;
      if (event.decode(data, 0, static_cast<int>(size)) == static_cast<int>(size))
        faults_.Take(event, identity().process);
    });
  });
}

void UdpBus::Handle(int64_t timeout_us) {
  if (!delayed_.empty()) timeout_us = std::min(timeout_us, delayed_.begin()->first - Now());
  pollfd fd{lcm_.getFileno(), POLLIN, 0};
  timespec wait{};
  timeout_us = std::max<int64_t>(timeout_us, 0);
  wait.tv_sec = timeout_us / 1000000;
  wait.tv_nsec = timeout_us % 1000000 * 1000;
  const bool come = ppoll(&fd, 1, &wait, nullptr) > 0;
  for (int i = 0; come && i < kBurst && lcm_.handleTimeout(0) > 0; ++i) {
  }
  HandOverDelayed();
}

int64_t UdpBus::Now() const { return SteadyMicroseconds() + clock_offset_; }

void UdpBus::SubscribeRaw(const std::string& channel, RawHandler handler) {
  subscriptions_.push_back({this, channel, std::move(handler), {}});
  auto* subscription = lcm_.subscribeFunction(prefix_ + channel, &Deliver, &subscriptions_.back());
  subscription->setQueueCapacity(QueueCapacity(channel));
}

void UdpBus::Deliver(const lcm::ReceiveBuffer* buffer, const std::string& /*channel*/,
                     Subscription* to) {
  UdpBus* bus = to->bus;
  const auto* data = static_cast<const uint8_t*>(buffer->data);
  if (const int64_t delay = bus->faults_.DelayOf(to->channel); delay > 0)
    bus->delayed_.insert({bus->Now() + delay, {to, Bytes(data, data + buffer->data_size)}});
  else
    bus->HandOver(to, data, buffer->data_size);
}

void UdpBus::HandOver(Subscription* to, const uint8_t* data, size_t size) {
  if (to->channel != "FAULT" && faults_.Loses()) return;
  const auto opened = Opened(to->channel, data, size, &to->heard);
  if (opened) to->handler(data, *opened);
}

void UdpBus::HandOverDelayed() {
  const int64_t now = Now();
  while (!delayed_.empty() && delayed_.begin()->first <= now) {
    const auto due = delayed_.extract(delayed_.begin());
    HandOver(due.mapped().to, due.mapped().bytes.data(), due.mapped().bytes.size());
  }
}

std::optional<size_t> UdpBus::Opened(const std::string& channel, const uint8_t* data, size_t size,
                                     Heard* heard) {
  if (IsHeavy(channel) || !seal_.on()) return size;
  const auto inside = seal_.Open(prefix_ + channel, data, size);
  if (!inside) {
    Refuse(channel, "without the seal of this vehicle's key; see --key-file");
    return std::nullopt;
  }
  const auto head = HeadOf(data, *inside);
  if (!head || heard->IsNew(*head)) return inside;  // without a head: malformed, and counted so
  Refuse(channel, "recorded and sent again");
  return std::nullopt;
}

void UdpBus::SubscribeEvery(const EveryHandler& handler) {
  every_ = handler;
  std::string heavy;  // LCM's patterns are Perl's
  for (const auto& row : ChannelTable())
    if (row.heavy) heavy += (heavy.empty() ? "" : "|") + row.channel;
  const std::string ours = "\\Q" + prefix_ + "\\E";
  lcm_.subscribeFunction(ours + ".*(" + heavy + ")", &ForwardEvery, this)
      ->setQueueCapacity(4 * QueueCapacity("LIDAR_SCAN"));
  lcm_.subscribeFunction(ours + "(?!.*(" + heavy + ")$).*", &ForwardEvery, this)
      ->setQueueCapacity(kEveryLight);
}

void UdpBus::ForwardEvery(const lcm::ReceiveBuffer* buffer, const std::string& channel,
                          UdpBus* bus) {
  if (IsLoopback(channel)) return;
  timespec wall{};
  clock_gettime(CLOCK_REALTIME, &wall);  // of which LCM's stamp of the arrival is
  const int64_t now = int64_t{wall.tv_sec} * 1000000 + wall.tv_nsec / 1000;
  const int64_t waited = std::clamp<int64_t>(now - buffer->recv_utime, 0, kLongestWait);
  const auto* data = static_cast<const uint8_t*>(buffer->data);
  const std::string name = channel.substr(bus->prefix_.size());
  const auto size = bus->Opened(name, data, buffer->data_size, &bus->every_heard_[name]);
  if (!size) return;
  bus->CountAny(name, data, *size);
  // Where the wall clock was set since it came it seems to have waited for as long.
  bus->every_arrived_ = std::max(bus->every_arrived_, bus->Now() - waited);
  bus->Guarded(channel, [&] { bus->every_(channel, bus->every_arrived_, data, *size); });
}

void UdpBus::PublishRaw(const std::string& channel, Bytes bytes) {
  if (!IsHeavy(channel)) seal_.Close(prefix_ + channel, &bytes);
  if (lcm_.publish(prefix_ + channel, bytes.data(), static_cast<unsigned>(bytes.size())) != 0)
    ReportError(fmt::format("{}: could not be sent ({} bytes)", channel, bytes.size()));
}

}  // namespace chase::bus
