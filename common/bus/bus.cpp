#include "common/bus/bus.h"

#include <exception>

#include "common/bus/channels.h"

namespace chase::bus {

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

bool Bus::IsForeign(const std::string& channel, const std::string& sender,
                    const std::string& vehicle) const {
  if (identity_.process.empty()) return false;
  return vehicle != identity_.vehicle || !MaySend(channel, sender);
}

std::vector<input_t> Bus::Inputs() const {
  std::vector<input_t> inputs;
  for (const auto& [channel, c] : counters_)
    if (c.last_seq >= 0) inputs.push_back({channel, c.last_seq});
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
