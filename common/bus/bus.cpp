#include "common/bus/bus.h"

#include <exception>

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

void Bus::Guarded(const std::string& channel, const std::function<void()>& handler) {
  // Below a backend there may be C frames: nothing may leave from here.
  try {
    handler();
  } catch (const std::exception& e) {
    ReportError(channel + ": handler failed: " + e.what());
  }
}

}  // namespace chase::bus
