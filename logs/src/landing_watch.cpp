#include "logs/src/landing_watch.h"

#include "common/world/flight_volume.h"

namespace chase::logs {

// The words of the bridge, and of the simulator in its stead.
bool LandingWatch::Lands(const status_t& message) {
  return message.detail.rfind("landing", 0) == 0;
}

void LandingWatch::Hear(const flight_state_t& message) {
  state_ = message.state;
  if (state_ != flight_state_t::IDLE && state_ != flight_state_t::READY)
    flies_ = state_ != flight_state_t::DONE;
}

void LandingWatch::Hear(const status_t& message) {
  if (message.name == "fcu") autopilot_ = Lands(message);
}

void LandingWatch::Mark(const world::GroundSpec& ground, TruthSample* sample) {
  constexpr double kTouchdown = 0.75;  // m/s: as fast as control sinks without a velocity
  const double height = sample->p.z() - world::GroundHeight(ground, sample->p.x(), sample->p.y());
  came_down_ = control_ || autopilot_ || (came_down_ && height < world::kFlightVolume.low);
  const bool slow = sample->speed <= kTouchdown;
  stands_ = stands_ && height < world::kFlightVolume.low;
  // Motors that are cut in the air end no flight: it falls first.
  lies_ = state_ == flight_state_t::DONE && (lies_ || (height < world::kFlightVolume.low && slow));
  sample->done = lies_;
  const bool waits = state_ == flight_state_t::IDLE || state_ == flight_state_t::READY;
  sample->may_stand = ((stands_ || came_down_) && slow) || (waits && !flies_) ||
                      state_ == flight_state_t::TAKEOFF || state_ == flight_state_t::LAND ||
                      state_ == flight_state_t::DONE;
}

}  // namespace chase::logs
