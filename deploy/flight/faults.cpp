#include "deploy/flight/faults.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "chase/event_t.hpp"
#include "common/bus/channels.h"

namespace chase::flight {

using Effect = world::FaultKind::Effect;

namespace {

constexpr uint64_t kStream = 0xB05;  // of the draws, apart from all noise
constexpr uint64_t kLongest = 200;   // bytes of a malformed message: longer than any light head

}  // namespace

Faults::Faults(const std::vector<world::FaultSpec>& faults, int64_t mission_start, int64_t seed,
               bus::Lockstep* lockstep)
    : mission_start_(mission_start),
      lockstep_(lockstep),
      bus_(lockstep->Connect()),
      random_(static_cast<uint64_t>(seed), kStream) {
  for (const world::FaultSpec& fault : faults) {
    const world::FaultKind& kind = world::KindOf(fault);
    const std::string process = kind.victim;
    if (kind.effect ==
        Effect::kDiskFull)  // deploy/fly asks for the configurations of such a flight
      throw std::runtime_error("fault " + fault.name + " " + world::Misfit(kind, true));
    if (kind.effect == Effect::kKill)
      Plan(
          fault, [=] { lockstep->Kill(process); }, [=] { lockstep->Start(process); });
    if (kind.effect == Effect::kFreeze)
      Plan(
          fault, [=] { lockstep->Freeze(process); }, [=] { lockstep->Thaw(process); });
    if (kind.effect == Effect::kDelay)
      Plan(
          fault, [=] { lockstep->SetDelay(kind.victim, std::llround(kind.amount * 1e6)); },
          [=] { lockstep->SetDelay(kind.victim, 0); });
    if (kind.effect == Effect::kLoss)
      Plan(
          fault, [this, lockstep, &kind] { lockstep->SetLoss(kind.amount, random_.Next()); },
          [=] { lockstep->SetLoss(0.0, 0); });
    if (kind.effect == Effect::kLoad)
      Plan(
          fault, [=] { lockstep->SetLoad(kind.amount); }, [=] { lockstep->SetLoad(1.0); });
    if (kind.effect == Effect::kFlood)
      Plan(
          fault, [this, &kind, end = Utime(fault.at + fault.duration)] { Flood(kind.amount, end); },
          [] {});
  }
}

int64_t Faults::Utime(double t) const { return mission_start_ + std::llround(t * 1e6); }

/// Random bytes on every channel now, and again until the end.
void Faults::Flood(double rate, int64_t end) {
  if (lockstep_->now() >= end) return;
  for (const bus::ChannelRow& row : bus::ChannelTable()) {
    bus::Bus::Bytes bytes(random_.Next() % kLongest);
    for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random_.Next());
    lockstep_->Inject(row.channel, std::move(bytes));
  }
  lockstep_->At(lockstep_->now() + std::llround(1e6 / rate), [=] { Flood(rate, end); });
}

void Faults::Plan(const world::FaultSpec& fault, const Strike& begin, const Strike& end) {
  lockstep_->At(Utime(fault.at), [this, fault, begin] {
    Announce(fault, event_t::BEGINS);
    begin();
  });
  lockstep_->At(Utime(fault.at + fault.duration), [this, fault, end] {
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
