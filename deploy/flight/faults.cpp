#include "deploy/flight/faults.h"

#include <cmath>

#include "chase/event_t.hpp"

namespace chase::flight {

using Effect = world::FaultKind::Effect;

Faults::Faults(const std::vector<world::FaultSpec>& faults, int64_t mission_start,
               bus::Lockstep* lockstep)
    : mission_start_(mission_start), lockstep_(lockstep), bus_(lockstep->Connect()) {
  for (const world::FaultSpec& fault : faults) {
    const world::FaultKind& kind = world::KindOf(fault);
    const std::string process = kind.process;
    if (kind.effect == Effect::kKill)
      Plan(
          fault, [=] { lockstep->Kill(process); }, [=] { lockstep->Start(process); });
    if (kind.effect == Effect::kFreeze)
      Plan(
          fault, [=] { lockstep->Freeze(process); }, [=] { lockstep->Thaw(process); });
  }
}

void Faults::Plan(const world::FaultSpec& fault, const Strike& begin, const Strike& end) {
  const auto at = [&](double t) { return mission_start_ + std::llround(t * 1e6); };
  lockstep_->At(at(fault.at), [this, fault, begin] {
    Announce(fault, event_t::BEGINS);
    begin();
  });
  lockstep_->At(at(fault.at + fault.duration), [this, fault, end] {
    Announce(fault, event_t::ENDS);
    end();
  });
}

void Faults::Announce(const world::FaultSpec& fault, int8_t phase) {
  event_t message{};
  message.utime = lockstep_->now();
  message.name = fault.name;
  message.phase = phase;
  bus_->Publish("FAULT", message);
}

}  // namespace chase::flight
