#include "deploy/flight/progress.h"

#include "common/bus/convert.h"

namespace chase::flight {

void Progress::SetScenario(const scenario_t& message) {
  if (known_) return;
  scenario_ = world::ParseScenario(message.yaml, message.name);
  solids_ = world::StaticSolids(scenario_);
  known_ = true;
}

void Progress::Add(const truth_t& truth) {
  last_ = truth;
  if (first_utime_ < 0) first_utime_ = truth.utime;
  if (!started() || truth.mission_time > scenario_.duration_s) return;
  ++samples_;
  visible_ += Visible(truth);
}

double Progress::distance() const {
  return (bus::ToVector(last_.pos) - bus::ToVector(last_.target_pos)).norm();
}

double Progress::visible_ratio() const {
  return samples_ > 0 ? static_cast<double>(visible_) / static_cast<double>(samples_) : 1.0;
}

void Progress::NoteArrival(int64_t now) {
  if (first_arrival_ < 0) first_arrival_ = now;
}

double Progress::RealTimeFactor(int64_t now) const {
  const int64_t wall = now - first_arrival_;
  return wall > 0 ? static_cast<double>(last_.utime - first_utime_) / static_cast<double>(wall)
                  : 1.0;
}

bool Progress::Visible(const truth_t& truth) const {
  const Eigen::Vector3d p = bus::ToVector(truth.pos), q = bus::ToVector(truth.target_pos);
  for (const auto& solid : solids_)
    if (world::SegmentHits(solid, p, q)) return false;
  for (const auto& mover : scenario_.movers)
    if (world::SegmentHits(world::MoverAt(mover, truth.mission_time).solid, p, q)) return false;
  return true;
}

}  // namespace chase::flight
