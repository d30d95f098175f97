#include "services/viewer/history.h"

#include <limits>

namespace chase::viewer {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// The input while it may be shown as what is, else nullptr.
template <class T>
const T* Current(const std::optional<T>& input, double most) {
  return input && world::IsFresh(input->age, most) ? &*input : nullptr;
}

}  // namespace

Sample SampleOf(const Scene& scene, double t) {
  Sample s;
  s.t = t;
  s.p_WB = s.p_WT = Eigen::Vector3d::Constant(kNone);
  s.distance = s.clearance = s.speed = s.plan_ms = kNone;
  if (const Drone* drone = Current(scene.drone, kMostShownAge.pose)) {
    s.p_WB = drone->p_WB;
    s.speed = drone->v_WB.norm();
    s.health = drone->health;
  }
  if (const Target* target = Current(scene.target, kMostShownAge.target)) {
    s.target_state = target->state;
    if (target->Known()) s.p_WT = target->p_WT;
    s.distance = (s.p_WB - s.p_WT).norm();
  }
  if (const Plan* plan = Current(scene.plan, kMostShownAge.plan)) {
    s.verdict = plan->verdict;
    if (plan->clearance >= 0.0) s.clearance = plan->clearance;
    if (scene.plan_ms >= 0.0) s.plan_ms = scene.plan_ms;
  }
  if (const Flight* flight = Current(scene.flight, kMostShownAge.flight)) s.flight = flight->state;
  s.processes = scene.processes;
  for (const std::string& fault : scene.faults) s.faults += (s.faults.empty() ? "" : " + ") + fault;
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
