#include "common/bus/log_bus.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "chase/status_t.hpp"
#include "common/bus/channels.h"
#include "common/bus/heard_order.h"
#include "common/bus/message_head.h"

namespace chase::bus {

std::string VehicleIn(const std::string& log) {
  LogReader reader(log);
  std::set<std::string> vehicles;
  for (LogEvent event; reader.Next(&event);) {
    const auto head = HeadOf(event.bytes.data(), event.bytes.size());
    if (!head) continue;
    for (const ChannelRow& row : ChannelTable())
      if (event.channel == head->vehicle + row.channel) vehicles.insert(head->vehicle);
  }
  if (vehicles.size() > 1)
    throw std::runtime_error(
        fmt::format("{}: is of several vehicles, '{}'; name one with --channel-prefix", log,
                    fmt::join(vehicles, "', '")));
  return vehicles.empty() ? "" : *vehicles.begin();
}

Identity IdentityIn(const std::string& log, const std::string& process,
                    const std::string& vehicle) {
  LogReader reader(log);
  for (LogEvent event; reader.Next(&event);) {
    const auto head = HeadOf(event.bytes.data(), event.bytes.size());
    if (head && head->sender == process && head->vehicle == vehicle)
      return {process, vehicle, head->sender_start};
  }
  return {process, vehicle, 0};
}

std::string VersionIn(const std::string& log, const std::string& process,
                      const std::string& vehicle) {
  LogReader reader(log);
  for (LogEvent event; reader.Next(&event);) {
    const auto head = HeadOf(event.bytes.data(), event.bytes.size());
    status_t status;
    if (head && head->sender == process && head->vehicle == vehicle &&
        status.decode(event.bytes.data(), 0, static_cast<int>(event.bytes.size())) > 0)
      return status.version;
  }
  return "";
}

LogBus::LogBus(const std::string& in, const std::string& out) : in_(in), out_(out) {}

void LogBus::SubscribeRaw(const std::string& channel, RawHandler handler) {
  handlers_[channel] = std::move(handler);
}

void LogBus::PublishRaw(const std::string& channel, Bytes bytes) {
  out_.Write(now_, identity().vehicle + channel, bytes);
}

/// The clock stands still for what was logged late.
void LogBus::TickAt(int64_t utime, Node* node) {
  now_ = std::max(now_, utime);
  CountTick();
  node->Tick(now_);
}

void LogBus::Hand(const LogEvent& event, Node* node, const After& after) {
  ++events_;
  const int64_t period = node->TickPeriod(), t = std::max(event.utime, reorders_ ? now_ : 0);
  if (period > 0 && !has_ticks_) {
    if (next_tick_ < 0) next_tick_ = t;
    for (; next_tick_ <= t; next_tick_ += period) node->Tick(now_ = next_tick_);
  }
  now_ = t;
  const std::string& prefix = identity().vehicle;
  const auto handler = event.channel.rfind(prefix, 0) == 0
                           ? handlers_.find(event.channel.substr(prefix.size()))
                           : handlers_.end();
  if (handler != handlers_.end()) {
    heard_.insert(handler->first);
    handler->second(event.bytes.data(), event.bytes.size());
  }
  if (after) after(now_);
}

void LogBus::Run(Node* node, const After& after) {
  if (handlers_.empty())
    throw std::runtime_error("--replay: this process hears no channel, so that no log moves it");
  std::set<std::string> channels;
  for (const auto& [channel, handler] : handlers_) channels.insert(channel);
  const HeardOrder order = OrderHeard(in_, identity().process, channels, identity().vehicle);
  shortfalls_ = order.Sentences();
  reorders_ = !order.events.empty();
  has_ticks_ = order.has_ticks;
  LogReader log(in_);
  LogEvent event;
  while (!reorders_ && log.Next(&event)) Hand(event, node, after);
  for (const auto& [position, utime] : order.events) {
    if (position < 0) {
      TickAt(utime, node);
      continue;
    }
    log.Seek(position);
    if (log.Next(&event)) Hand(event, node, after);
  }
  if (events_ == 0) throw std::runtime_error(in_ + ": holds no event; is it an LCM log?");
  if (heard_.empty())
    throw std::runtime_error(fmt::format("{}: holds none of the channels that are heard: {}", in_,
                                         fmt::join(channels, ", ")));
  std::vector<std::string> lacking;
  for (const std::string& channel : channels)
    if (heard_.count(channel) + order.missing.count(channel) == 0) lacking.push_back(channel);
  if (!lacking.empty())
    shortfalls_.push_back(fmt::format("the log holds nothing of {}", fmt::join(lacking, ", ")));
  out_.Close();
}

}  // namespace chase::bus
