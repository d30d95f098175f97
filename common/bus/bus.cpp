#include "common/bus/bus.h"

#include <algorithm>
#include <exception>
#include <stdexcept>

#include "common/bus/channels.h"
#include "common/bus/message_head.h"

namespace chase::bus {

namespace {

constexpr size_t kMostChannels = 200;  // names of strangers are not remembered without end

}  // namespace

bool Bus::Count(const std::string& channel, const std::string& problem, int32_t seq,
                ChannelCounters* counters) {
  if (!problem.empty()) {
    ++counters->malformed;
    ReportError(channel + ": " + problem);
    return false;
  }
  ++counters->received;
  if (counters->last_seq >= 0 && seq > counters->last_seq + 1)
    counters->dropped += seq - counters->last_seq - 1;
  counters->last_seq = seq;  // a lower number is a restarted sender
  return true;
}

void Bus::SubscribeEvery(const EveryHandler& /*handler*/) {
  throw std::runtime_error("this bus does not hand over every channel; use the live one");
}

void Bus::CountAny(const std::string& channel, const uint8_t* data, size_t size) {
  if (counters_.size() >= kMostChannels && counters_.count(channel) == 0) return;
  ChannelCounters& counters = counters_[channel];
  const auto head = HeadOf(data, size);
  if (!head) {
    ++counters.malformed;
    return;
  }
  ++counters.received;
  counters.last_seq = head->seq;
  const auto [last, fresh] =
      last_seq_.try_emplace({channel, head->sender, head->sender_start}, head->seq);
  if (!fresh && head->seq > last->second) counters.dropped += int64_t{head->seq} - last->second - 1;
  last->second = std::max(last->second, head->seq);
}

bool Bus::IsForeign(const std::string& channel, const std::string& sender,
                    const std::string& vehicle) const {
  if (identity_.process.empty()) return false;
  return vehicle != identity_.vehicle || !MaySend(channel, sender);
}

void Bus::Refuse(const std::string& channel, const std::string& why) {
  if (counters_.size() < kMostChannels || counters_.count(channel) > 0)
    ++counters_[channel].foreign;
  ReportError(channel + ": " + why);
}

std::vector<input_t> Bus::Inputs() const {
  std::vector<input_t> inputs;
  for (const auto& [channel, c] : counters_)
    if (c.last_seq >= 0) inputs.push_back({channel, c.last_seq});
  if (ticks_ > 0) inputs.push_back({kTick, ticks_});
  return inputs;
}

void Bus::Guarded(const std::string& channel, const std::function<void()>& handler) {
  // Below a backend there may be C frames: nothing may leave from here.
  try {
    handler();
  } catch (const std::exception& e) {
    ReportError(channel + ": handler failed: " + e.what());
  }
}

}  // namespace chase::bus
