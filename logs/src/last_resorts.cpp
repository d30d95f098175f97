#include "logs/src/last_resorts.h"

#include <algorithm>

#include "chase/flight_state_t.hpp"
#include "chase/plan_t.hpp"
#include "logs/src/landing_figures.h"

namespace chase::logs {
namespace {

constexpr double kFaster = 0.05;  // m/s above the start's speed
constexpr double kStep = 0.02;    // s between samples of a plan's speed

/// Neither on the ground, nor climbing, nor on the way down. Without a mission process a flight is
/// up while its mission lasts.
bool IsUp(const FlightRecord& record, double t) {
  const auto state = StateAt(record, t);
  return !state || (*state > flight_state_t::TAKEOFF && !ComesDown(record, t));
}

double TopSpeed(const world::Trajectory& way, double from, double to) {
  double speed = 0.0;
  for (double t = from; t <= to; t += kStep) speed = std::max(speed, way.Velocity(t).norm());
  return speed;
}

/// Up to its stop and along that.
bool SpeedsUp(const PlanSample& plan) {
  const double until = plan.stop ? plan.stop->start : plan.position.end();
  const double top = TopSpeed(plan.position, plan.t, until);
  const double top_of_stop =
      plan.stop ? TopSpeed(*plan.stop, plan.stop->start, plan.stop->end()) : 0.0;
  return std::max(top, top_of_stop) > plan.position.Velocity(plan.t).norm() + kFaster;
}

}  // namespace

void AddLastResorts(const FlightRecord& record, Metrics* m) {
  for (const PlanSample& plan : record.plans) {
    if (!record.InMission(plan.t) || !IsUp(record, plan.t)) continue;
    ++m->plans_in_air;
    const bool brakes = plan.verdict == plan_t::BRAKE;
    m->uncertified_brakes +=
        plan.certified_clearance < 0.0 && (brakes || plan.verdict == plan_t::MITIGATE);
    m->accelerating_brakes += brakes && SpeedsUp(plan);
  }
}

}  // namespace chase::logs
