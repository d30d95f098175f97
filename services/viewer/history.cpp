#include "services/viewer/history.h"

#include <limits>

#include "common/world/ages.h"

namespace chase::viewer {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

}  // namespace

Sample SampleOf(const Scene& scene, double t) {
  Sample s;
  s.t = t;
  s.p_WB = s.p_WT = Eigen::Vector3d::Constant(kNone);
  s.distance = s.clearance = s.speed = s.plan_ms = kNone;
  if (scene.drone) {
    s.p_WB = scene.drone->p_WB;
    s.speed = scene.drone->v_WB.norm();
    s.health = scene.drone->health;
  }
  if (scene.target) {
    s.target_state = scene.target->state;
    if (scene.target->Known()) s.p_WT = scene.target->p_WT;
    s.distance = (s.p_WB - s.p_WT).norm();
  }
  if (scene.plan) {
    s.verdict = scene.plan->verdict;
    if (scene.plan->clearance >= 0.0) s.clearance = scene.plan->clearance;
  }
  if (scene.flight && scene.flight->age <= world::kMostAge.flight_state)
    s.flight = scene.flight->state;
  s.processes = scene.processes;
  for (const std::string& fault : scene.faults) s.faults += (s.faults.empty() ? "" : " + ") + fault;
  if (scene.plan_ms >= 0.0) s.plan_ms = scene.plan_ms;
  return s;
}

void History::Add(const Sample& sample) {
  if (!samples_.empty() && sample.t < samples_.back().t) samples_.clear();  // another flight
  samples_.push_back(sample);
  while (samples_.front().t < sample.t - length_) samples_.pop_front();
  if (samples_.size() <= kMost) return;
  std::deque<Sample> half;
  for (size_t i = 0; i < samples_.size(); i += 2) half.push_back(samples_[i]);
  samples_ = std::move(half);
}

void History::ForgetPositions() {
  for (Sample& s : samples_) s.p_WB = s.p_WT = Eigen::Vector3d::Constant(kNone);
}

}  // namespace chase::viewer
