#include "common/bus/log_bus.h"

#include <algorithm>
#include <set>
#include <stdexcept>

#include "common/bus/heard_order.h"
#include "common/bus/message_head.h"

namespace chase::bus {

Identity IdentityIn(const std::string& log, const std::string& process) {
  lcm::LogFile file(log, "r");
  while (const lcm::LogEvent* event = file.good() ? file.readNextEvent() : nullptr) {
    const auto head = HeadOf(event->data, static_cast<size_t>(std::max(0, event->datalen)));
    if (head && head->sender == process) return {head->sender, head->vehicle, head->sender_start};
  }
  return {process, "", 0};
}

LogBus::LogBus(const std::string& in, const std::string& out) : in_(in), out_(out) {}

void LogBus::SubscribeRaw(const std::string& channel, RawHandler handler) {
  handlers_[channel] = std::move(handler);
}

void LogBus::PublishRaw(const std::string& channel, Bytes bytes) {
  out_.Write(now_, channel, bytes);
}

std::string LogBus::Handled() const {
  std::string names;
  for (const auto& [channel, handler] : handlers_) names += (names.empty() ? "" : ", ") + channel;
  return names;
}

/// The clock stands still for what was logged late.
void LogBus::TickAt(int64_t utime, Node* node) {
  now_ = std::max(now_, utime);
  CountTick();
  node->Tick(now_);
}

void LogBus::Hand(const lcm::LogEvent& event, Node* node, const After& after) {
  ++events_;
  const int64_t period = node->TickPeriod(), t = std::max(event.timestamp, reorders_ ? now_ : 0);
  if (period > 0 && !has_ticks_) {
    if (next_tick_ < 0) next_tick_ = t;
    for (; next_tick_ <= t; next_tick_ += period) node->Tick(now_ = next_tick_);
  }
  now_ = t;
  const auto handler = handlers_.find(event.channel);
  if (handler != handlers_.end()) {
    heard_ = true;
    handler->second(static_cast<const uint8_t*>(event.data), static_cast<size_t>(event.datalen));
  }
  if (after) after(now_);
}

void LogBus::Run(Node* node, const After& after) {
  std::set<std::string> channels;
  for (const auto& [channel, handler] : handlers_) channels.insert(channel);
  const HeardOrder order = OrderHeard(in_, identity().process, channels);
  shortfalls_ = order.Sentences();
  reorders_ = !order.events.empty();
  has_ticks_ = order.has_ticks;
  lcm::LogFile log(in_, "r");
  heard_ = handlers_.empty();
  if (!reorders_)
    while (const lcm::LogEvent* event = log.readNextEvent()) Hand(*event, node, after);
  for (const auto& [position, utime] : order.events) {
    if (position < 0) {
      TickAt(utime, node);
      continue;
    }
    fseeko(log.getFilePtr(), position, SEEK_SET);
    if (const lcm::LogEvent* event = log.readNextEvent()) Hand(*event, node, after);
  }
  if (events_ == 0) throw std::runtime_error(in_ + ": holds no event; is it an LCM log?");
  if (!heard_)
    throw std::runtime_error(in_ + ": holds none of the channels that are heard: " + Handled());
  out_.Close();
}

}  // namespace chase::bus
