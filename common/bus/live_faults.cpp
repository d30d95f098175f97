#include "common/bus/live_faults.h"

#include <cmath>

#include "common/world/fault.h"

namespace chase::bus {

namespace {

uint64_t StreamOf(const std::string& name) {
  uint64_t stream = 0;
  for (const char letter : name) stream = 31 * stream + static_cast<unsigned char>(letter);
  return stream;
}

}  // namespace

void LiveFaults::Take(const event_t& event, const std::string& process) {
  using Effect = world::FaultKind::Effect;
  const bool begins = event.phase == event_t::BEGINS;
  for (const world::FaultKind& kind : world::FaultKinds()) {
    if (kind.name != event.name) continue;
    if (kind.effect == Effect::kDelay)
      delays_[kind.victim] = begins ? std::llround(kind.amount * 1e6) : 0;
    if (kind.effect != Effect::kLoss) continue;
    loss_ = begins ? kind.amount : 0.0;
    draws_ = world::Random{seed_, StreamOf(event.name + " of " + process)};
  }
}

int64_t LiveFaults::DelayOf(const std::string& channel) const {
  const auto delay = delays_.find(channel);
  return delay == delays_.end() ? 0 : delay->second;
}

bool LiveFaults::Loses() { return loss_ > 0.0 && draws_.Uniform() < loss_; }

}  // namespace chase::bus
