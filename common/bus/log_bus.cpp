#include "common/bus/log_bus.h"

#include <algorithm>
#include <stdexcept>

namespace chase::bus {

namespace {

/// What every message begins with (lcmtypes/README.md), read without knowing its type.
class Head {
 public:
  Head(const void* data, int size)
      : at_(static_cast<const uint8_t*>(data)), end_(at_ + std::max(0, size)) {}

  bool Read(Identity* sender) {
    at_ += std::min<ptrdiff_t>(kBeforeSender, end_ - at_);
    return Text(&sender->process) && Text(&sender->vehicle) && Integer(8, &sender->start);
  }

 private:
  static constexpr ptrdiff_t kBeforeSender = 8 + 8 + 4;  // fingerprint, utime, seq

  bool Integer(int bytes, int64_t* value) {
    if (end_ - at_ < bytes) return false;
    uint64_t bits = 0;
    for (int i = 0; i < bytes; ++i) bits = bits << 8 | *at_++;
    *value = static_cast<int64_t>(bits);
    return true;
  }
  bool Text(std::string* text) {
    int64_t length = 0;  // with the zero at its end
    if (!Integer(4, &length) || length < 1 || length > end_ - at_) return false;
    text->assign(at_, at_ + length - 1);
    at_ += length;
    return true;
  }

  const uint8_t* at_;
  const uint8_t* end_;
};

}  // namespace

Identity IdentityIn(const std::string& log, const std::string& process) {
  lcm::LogFile file(log, "r");
  while (const lcm::LogEvent* event = file.good() ? file.readNextEvent() : nullptr) {
    Identity sender;
    if (Head(event->data, event->datalen).Read(&sender) && sender.process == process) return sender;
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

void LogBus::Run(Node* node) {
  lcm::LogFile log(in_, "r");
  if (!log.good()) throw std::runtime_error(in_ + ": cannot be read; --replay needs an LCM log");
  const int64_t period = node->TickPeriod();
  int64_t next_tick = -1;
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    ++events_;
    if (period > 0) {
      if (next_tick < 0) next_tick = event->timestamp;
      for (; next_tick <= event->timestamp; next_tick += period) node->Tick(now_ = next_tick);
    }
    now_ = event->timestamp;
    const auto handler = handlers_.find(event->channel);
    if (handler != handlers_.end())
      handler->second(static_cast<const uint8_t*>(event->data),
                      static_cast<size_t>(event->datalen));
  }
  if (events_ == 0) throw std::runtime_error(in_ + ": holds no event; is it an LCM log?");
  out_.Close();
}

}  // namespace chase::bus
