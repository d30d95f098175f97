#include "services/simulator/sensor_faults.h"

#include <algorithm>

namespace chase::simulator {

SensorFaults::SensorFaults(const std::vector<world::FaultSpec>& faults) {
  for (const world::FaultSpec& fault : faults)
    if (const world::FaultKind& kind = world::KindOf(fault); kind.process == "simulator")
      entries_.push_back({world::Settled(fault, 0.0, 0, 0), kind.effect});
}

std::vector<SensorFaults::Change> SensorFaults::Advance(double t) {
  t += 1e-6;  // a tick's time may lie a rounding below the one that is meant
  std::vector<Change> changes;
  for (Entry& entry : entries_) {
    const bool active = t >= entry.fault.at && t < entry.fault.at + entry.fault.duration;
    if (active != entry.active) changes.push_back({entry.fault.name, active});
    entry.active = active;
  }
  return changes;
}

bool SensorFaults::Active(world::FaultKind::Effect effect) const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [&](const Entry& e) { return e.active && e.effect == effect; });
}

}  // namespace chase::simulator
