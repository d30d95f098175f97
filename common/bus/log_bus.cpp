#include "common/bus/log_bus.h"

#include <algorithm>
#include <stdexcept>

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

void LogBus::Run(Node* node, const std::function<void(int64_t)>& after) {
  lcm::LogFile log(in_, "r");
  if (!log.good()) throw std::runtime_error(in_ + ": cannot be read; --replay needs an LCM log");
  const int64_t period = node->TickPeriod();
  int64_t next_tick = -1;
  bool heard = handlers_.empty();
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    ++events_;
    if (period > 0) {
      if (next_tick < 0) next_tick = event->timestamp;
      for (; next_tick <= event->timestamp; next_tick += period) node->Tick(now_ = next_tick);
    }
    now_ = event->timestamp;
    const auto handler = handlers_.find(event->channel);
    if (handler != handlers_.end()) {
      heard = true;
      handler->second(static_cast<const uint8_t*>(event->data),
                      static_cast<size_t>(event->datalen));
    }
    if (after) after(now_);
  }
  if (events_ == 0) throw std::runtime_error(in_ + ": holds no event; is it an LCM log?");
  if (!heard)
    throw std::runtime_error(in_ + ": holds none of the channels that are heard: " + Handled());
  out_.Close();
}

}  // namespace chase::bus
