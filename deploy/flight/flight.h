#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "common/bus/lockstep.h"
#include "deploy/flight/faults.h"
#include "deploy/flight/flight_configs.h"

namespace chase::flight {

/// Time from an event to the arrival of its answer, microseconds, per process: a little above what
/// the processes need on the drone's computer.
const std::map<std::string, int64_t>& Latencies();

/// A whole flight in one thread and in logical time.
class Flight {
 public:
  /// Power-on is at kPowerOn. In truth mode the simulator stands in for odometry, mapping and
  /// perception. Throws std::runtime_error, one line, on a bad configuration.
  Flight(const world::Scenario& scenario, const FlightConfigs& configs);

  bus::Lockstep& lockstep() { return lockstep_; }
  /// Runs until mission time `t` [s].
  void RunUntil(double t);

  static constexpr int64_t kPowerOn = 1000000;  // us

 private:
  double settle_;
  bus::Lockstep lockstep_;
  Faults faults_;
};

}  // namespace chase::flight
