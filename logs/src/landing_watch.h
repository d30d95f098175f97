#pragma once

#include "chase/flight_state_t.hpp"
#include "chase/status_t.hpp"
#include "chase/tracking_t.hpp"
#include "common/world/scenario.h"
#include "logs/src/flight_record.h"

namespace chase::logs {

/// Tells a landing from a contact with the ground: the body has not been up yet, the flight's state
/// is one of landing or standing, or control or the autopilot has come down by itself, gently, and
/// is not yet back at the heights of plans. In flight IDLE and READY are the words of a mission
/// process that has just begun anew. Also tells when the flight is over: in DONE, on the ground.
class LandingWatch {
 public:
  void Hear(const flight_state_t& message);
  void Hear(const tracking_t& message) { control_ = message.following == tracking_t::LAND; }
  void Hear(const status_t& message);
  /// Does FCU_STATUS say that the autopilot comes down by itself?
  static bool Lands(const status_t& message);

  /// Fills in `may_stand` and `done`. Samples come in the order of time.
  void Mark(const world::GroundSpec& ground, TruthSample* sample);

 private:
  int8_t state_ = -1;   // of flight_state_t, once it is heard
  bool flies_ = false;  // by what was heard last but IDLE and READY
  bool control_ = false, autopilot_ = false, stands_ = true, came_down_ = false, lies_ = false;
};

}  // namespace chase::logs
