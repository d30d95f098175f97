#include "logs/src/sweep_latency.h"

#include <algorithm>
#include <iterator>

#include "common/bus/message_head.h"
#include "logs/src/good_message.h"

namespace chase::logs {
namespace {

constexpr const char* kWay[] = {"LIDAR_SCAN", "SCAN_REGISTERED", "OBSTACLES", "PLAN",
                                "ATTITUDE_SETPOINT"};

}  // namespace

void SweepLatency::Add(int64_t when, const LogEvent& event) {
  const auto step = std::find_if(std::begin(kWay), std::end(kWay),
                                 [&](const char* name) { return IsOn(event, name); });
  if (step == std::end(kWay)) return;
  const auto head = bus::HeadOf(event.bytes.data(), event.bytes.size());
  if (!head) return;
  if (step == std::begin(kWay)) {
    waiting_.insert(when);
    newest_[*step][head->seq] = when;
    return;
  }
  const std::map<int32_t, int64_t>& before = newest_[*std::prev(step)];
  for (const auto& input : head->inputs) {
    const auto found = before.find(input.seq);
    if (input.channel != *std::prev(step) || found == before.end()) continue;
    newest_[*step][head->seq] = found->second;
    if (std::next(step) != std::end(kWay)) return;
    const auto end = waiting_.upper_bound(found->second);
    for (auto sweep = waiting_.begin(); sweep != end; ++sweep)
      samples_.emplace_back(*sweep, when - *sweep);
    waiting_.erase(waiting_.begin(), end);
    return;
  }
}

}  // namespace chase::logs
