#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "common/bus/lockstep.h"
#include "common/world/fault.h"
#include "common/world/random.h"

namespace chase::flight {

/// Lets the flight's faults strike its processes and its bus, each with a message on FAULT. Those
/// of the sensors are the simulator's.
class Faults {
 public:
  /// Each fault has its time and duration; `mission_start` is mission time zero, microseconds. The
  /// lockstep stays and holds every process that is struck. `seed` is the flight's.
  Faults(const std::vector<world::FaultSpec>& faults, int64_t mission_start, int64_t seed,
         bus::Lockstep* lockstep);

 private:
  using Strike = std::function<void()>;
  void Plan(const world::FaultSpec& fault, const Strike& begin, const Strike& end);
  int64_t Utime(double t) const;
  void Flood(double rate, int64_t end);
  void Announce(const world::FaultSpec& fault, int8_t phase);

  int64_t mission_start_;
  bus::Lockstep* lockstep_;
  std::unique_ptr<bus::Bus> bus_;
  world::Random random_;
};

}  // namespace chase::flight
