#include "deploy/flight/collision_watch.h"

#include "logs/src/read_flight.h"

namespace chase::flight {

void CollisionWatch::Add(const truth_t& truth) {
  if (time_) return;
  if (!start_) start_ = logs::MissionStart(truth);
  logs::TruthSample sample = logs::ToSample(truth, *start_);
  sample.may_stand = logs::MayStand(state_, descends_, sample.speed);
  if (record_.InMission(sample.t) && !score_(sample).Safe()) time_ = sample.t;
}

void CollisionWatch::Add(const flight_state_t& state) { state_ = state.state; }

void CollisionWatch::Add(const tracking_t& tracking) {
  descends_ = tracking.following == tracking_t::LAND;
}

}  // namespace chase::flight
