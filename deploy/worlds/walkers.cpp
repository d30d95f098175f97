#include "deploy/worlds/walkers.h"

#include <algorithm>
#include <cmath>

#include "deploy/worlds/way.h"

namespace chase::worlds {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kStep = 0.1;        // s between the instants that are checked
constexpr double kReserve = 0.15;    // m beyond the least distances, for what moves in a step
constexpr double kHoverTime = 4.0;   // s of the mission in which the drone may still hover
constexpr double kHoverClear = 1.5;  // m
constexpr int kAttempts = 40;

/// Where a walker of this radius may be at which time.
class FreeTime {
 public:
  FreeTime(const world::Scenario& scenario, const Area& area, double radius)
      : area_(area),
        radius_(radius),
        reach_(TargetReach(scenario.target)),
        start_(scenario.chaser.start.head<2>()),
        path_(world::TargetMotion(scenario)),
        solids_(world::StaticSolids(scenario)),
        movers_(scenario.movers) {}

  bool At(const Vector2d& p, double t) const {
    if (!area_.Contains(p, radius_)) return false;
    if ((p - path_.Position(t)).norm() < radius_ + reach_ + kWalkerToTarget + kReserve)
      return false;
    if (t < kHoverTime && (p - start_).norm() < kHoverClear + radius_) return false;
    return ClearOf(p, t);
  }

  /// Straight at constant speed, or standing.
  bool Leg(const Vector2d& from, const Vector2d& to, double t, double duration) const {
    for (double s = 0.0; s < duration + kStep; s += kStep)
      if (!At(from + std::min(1.0, s / duration) * (to - from), t + s)) return false;
    return true;
  }

 private:
  bool ClearOf(const Vector2d& p, double t) const {
    for (const auto& solid : solids_)
      if (SignedDistance(solid, {p.x(), p.y(), std::min(solid.center.z(), 1.0)}) < radius_ + 0.1)
        return false;
    return std::all_of(movers_.begin(), movers_.end(), [&](const world::MoverSpec& mover) {
      const world::Solid other = world::MoverAt(mover, t).solid;
      return SignedDistance(other, {p.x(), p.y(), other.center.z()}) >= radius_ + kReserve;
    });
  }

  Area area_;
  double radius_, reach_;
  Vector2d start_;
  world::PathMotion path_;
  std::vector<world::Solid> solids_;
  std::vector<world::MoverSpec> movers_;
};

struct Step {
  Vector2d to;
  double duration;
};

/// What a person does next: stands a while, turns back, comes near `there`, or walks on some other
/// way.
Step NextStep(const Vector2d& at, const Vector2d& there, double pace, double* heading,
              Random* random) {
  const double choice = random->Uniform();
  if (choice < 0.2) return {at, random->Uniform(0.5, 4.0)};
  const double towards = std::atan2(there.y() - at.y(), there.x() - at.x());
  *heading = choice < 0.4   ? *heading + kPi
             : choice < 0.7 ? towards + random->Uniform(-0.5, 0.5)
                            : *heading + random->Uniform(-1.5, 1.5);
  const double length = random->Uniform(1.0, 8.0);
  const double speed = std::clamp(pace * random->Uniform(0.8, 1.2), 0.4, 1.4);
  return {at + Polar(*heading, length), length / speed};
}

}  // namespace

std::optional<world::MoverSpec> DrawWalker(const world::Scenario& scenario, const Area& area,
                                           Random* random) {
  world::MoverSpec walker;
  const double radius = random->Uniform(0.2, 0.3), height = random->Uniform(1.55, 1.9);
  const double pace = random->Uniform(0.4, 1.4);
  walker.shape = "cylinder";
  walker.size = {2.0 * radius, 2.0 * radius, height};
  const FreeTime free(scenario, area, radius);
  const world::PathMotion path = world::TargetMotion(scenario);
  Vector2d at = area.Point(random, radius);
  const auto add = [&](const Vector2d& p, double t) {
    const double foot = world::GroundHeight(scenario.world.ground, p.x(), p.y());
    walker.waypoints.emplace_back(p.x(), p.y(), foot + 0.5 * height);
    walker.times.push_back(t);
  };
  double t = 0.0, heading = random->Uniform(0.0, 2.0 * kPi);
  if (!free.At(at, t)) return std::nullopt;
  add(at, t);
  while (t < scenario.duration_s + 1.0) {
    int tries = 0;
    for (; tries < kAttempts; ++tries) {
      const Step step =
          NextStep(at, path.Position(t + random->Uniform(-4.0, 6.0)), pace, &heading, random);
      if (!free.Leg(at, step.to, t, step.duration)) continue;
      add(at = step.to, t += step.duration);
      break;
    }
    if (tries == kAttempts) return std::nullopt;
  }
  return walker;
}

bool AddWalkers(int count, const Area& area, Random* random, world::Scenario* scenario) {
  for (int i = 0; i < count; ++i) {
    std::optional<world::MoverSpec> walker;
    for (int tries = 0; tries < kAttempts && !walker; ++tries)
      walker = DrawWalker(*scenario, area, random);
    if (!walker) return false;
    scenario->movers.push_back(*walker);
  }
  return true;
}

}  // namespace chase::worlds
