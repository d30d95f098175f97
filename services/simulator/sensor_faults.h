#pragma once

#include <string>
#include <vector>

#include "common/world/fault.h"

namespace chase::simulator {

/// What the flight's faults do to the sensors. Times are mission time, s.
class SensorFaults {
 public:
  struct Change {
    std::string name;
    bool begins;
  };

  /// Each fault has its time; a negative duration is its kind's. Those that strike no sensor are
  /// left out.
  explicit SensorFaults(const std::vector<world::FaultSpec>& faults);

  /// What begins or ends at `t` or since the last call; times must not fall.
  std::vector<Change> Advance(double t);

  /// No sweep leaves the LiDAR.
  bool LidarSilent() const { return Active(world::FaultKind::Effect::kSilenceLidar); }

 private:
  struct Entry {
    world::FaultSpec fault;
    world::FaultKind::Effect effect;
    bool active = false;
  };
  bool Active(world::FaultKind::Effect effect) const;

  std::vector<Entry> entries_;
};

}  // namespace chase::simulator
