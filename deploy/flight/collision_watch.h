#pragma once

#include <cstdint>
#include <optional>

#include "chase/flight_state_t.hpp"
#include "chase/tracking_t.hpp"
#include "chase/truth_t.hpp"
#include "logs/src/flight_record.h"
#include "logs/src/score.h"

namespace chase::flight {

/// Notices the first contact of a flight while it flies, by the score that its metrics are made of.
class CollisionWatch {
 public:
  explicit CollisionWatch(const world::Scenario& scenario) : score_(scenario) {
    record_.scenario = scenario;
  }

  void Add(const truth_t& truth);
  void Add(const flight_state_t& state);
  void Add(const tracking_t& tracking);

  /// Mission time of the first contact, s.
  std::optional<double> time() const { return time_; }

 private:
  logs::Scorer score_;
  logs::FlightRecord record_;     // of the scenario alone; says when the mission lasts
  std::optional<int64_t> start_;  // mission time zero, microseconds
  int8_t state_ = -1;             // of flight_state_t, once it is heard
  bool descends_ = false;         // control does, by itself
  std::optional<double> time_;
};

}  // namespace chase::flight
