#include "deploy/flight/collision_watch.h"

#include "logs/src/read_flight.h"

namespace chase::flight {

void CollisionWatch::Add(const truth_t& truth) {
  if (time_) return;
  if (!start_) start_ = logs::MissionStart(truth);
  logs::TruthSample sample = logs::ToSample(truth, *start_);
  landing_.Mark(record_.scenario.world.ground, &sample);
  if (record_.InMission(sample.t) && !score_(sample).Safe()) time_ = sample.t;
}

}  // namespace chase::flight
