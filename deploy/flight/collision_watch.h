#pragma once

#include <cstdint>
#include <optional>

#include "chase/truth_t.hpp"
#include "logs/src/flight_record.h"
#include "logs/src/landing_watch.h"
#include "logs/src/score.h"

namespace chase::flight {

/// Notices the first contact of a flight while it flies, by the score that its metrics are made of.
class CollisionWatch {
 public:
  explicit CollisionWatch(const world::Scenario& scenario) : score_(scenario) {
    record_.scenario = scenario;
  }

  void Add(const truth_t& truth);
  /// What tells of a landing: FLIGHT_STATE, TRACKING, FCU_STATUS.
  template <class Message>
  void Add(const Message& message) {
    landing_.Hear(message);
  }

  /// Mission time of the first contact, s.
  std::optional<double> time() const { return time_; }

 private:
  logs::Scorer score_;
  logs::FlightRecord record_;     // of the scenario alone; says when the mission lasts
  std::optional<int64_t> start_;  // mission time zero, microseconds
  logs::LandingWatch landing_;
  std::optional<double> time_;
};

}  // namespace chase::flight
