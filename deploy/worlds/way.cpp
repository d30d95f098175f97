#include "deploy/worlds/way.h"

#include <algorithm>
#include <cmath>

namespace chase::worlds {

using Eigen::Vector2d;

namespace {

constexpr double kSharpest = 2.4;     // rad; sharper turns are taken seldom, on the spot
constexpr double kElevation = 0.17;   // rad at which the target is seen from above at the hover
constexpr double kSearchTime = 12.0;  // s; a full turn at planning's search_yaw_rate and some more
constexpr double kStanding = 0.12;    // m, body's origin above the ground

double TurnAt(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  const Vector2d in = b - a, out = c - b;
  return std::abs(std::atan2(in.x() * out.y() - in.y() * out.x(), in.dot(out)));
}

}  // namespace

std::vector<Vector2d> Nodes(const Area& area, int count, double apart, Random* random) {
  std::vector<Vector2d> nodes;
  for (int tries = 0; tries < 60 * count && static_cast<int>(nodes.size()) < count; ++tries) {
    const Vector2d p = area.Point(random, 0.0);
    if (std::all_of(nodes.begin(), nodes.end(),
                    [&](const Vector2d& other) { return (p - other).norm() >= apart; }))
      nodes.push_back(p);
  }
  return nodes;
}

std::vector<Vector2d> Tour(const std::vector<Vector2d>& nodes, double length, double leg_min,
                           Random* random) {
  std::vector<Vector2d> way = {
      nodes[static_cast<std::size_t>(Whole(random, 0, static_cast<int>(nodes.size()) - 1))]};
  double driven = 0.0;
  for (int tries = 0; driven < length && tries < 10000; ++tries) {
    const Vector2d& next =
        nodes[static_cast<std::size_t>(Whole(random, 0, static_cast<int>(nodes.size()) - 1))];
    const double leg = (next - way.back()).norm();
    if (leg < leg_min || (leg > 3.0 * leg_min && !Chance(random, 0.02))) continue;
    const bool sharp = way.size() > 1 && TurnAt(way[way.size() - 2], way.back(), next) > kSharpest;
    if (sharp && !Chance(random, 0.03)) continue;
    way.push_back(next);
    driven += leg;
  }
  return way;
}

world::TargetSpec DrawTarget(const TargetLimits& limits, Random* random) {
  world::TargetSpec target;
  const double shape = random->Uniform();
  target.shape = shape < 0.8 ? "cylinder" : shape < 0.9 ? "box" : "sphere";
  target.radius = RoundTo(random->Uniform(0.12, 0.25), 0.01);
  target.height = RoundTo(random->Uniform(0.4, 0.8), 0.01);
  if (target.shape == "sphere") target.height = 2.0 * target.radius;
  target.base = RoundTo(random->Uniform(0.25, 0.45), 0.01);
  const double length = random->Uniform(0.45, limits.largest_carrier);
  target.carrier_size = {length, random->Uniform(0.7, 0.85) * length, target.base};
  target.speed = random->Uniform(limits.speed_min, limits.speed_max);
  target.acceleration = random->Uniform(0.5, 1.5);
  target.lateral_acceleration = random->Uniform(0.8, 2.0);
  target.corner_radius = random->Uniform(limits.corner_min, limits.corner_max);
  return target;
}

void AddStops(bool wait_at_start, Random* random, world::TargetSpec* target) {
  target->stops.clear();
  if (wait_at_start) target->stops.push_back({0, kSearchTime});
  const auto& way = target->waypoints;
  for (std::size_t i = 1; i + 1 < way.size(); ++i) {
    const bool sharp = TurnAt(way[i - 1], way[i], way[i + 1]) > kSharpest;
    if (!sharp && !Chance(random, 0.2)) continue;
    const double rest = Chance(random, 0.6) ? random->Uniform(0.5, 4.0) : 0.0;
    target->stops.push_back({static_cast<int>(i), RoundTo(rest, 0.1)});
  }
}

double TargetReach(const world::TargetSpec& target) {
  const double carrier = 0.5 * target.carrier_size.head<2>().norm();
  return std::max(carrier, target.radius * (target.shape == "box" ? std::sqrt(2.0) : 1.0));
}

bool PlaceChaser(const Area& area, double distance, bool hidden, Random* random,
                 world::Scenario* scenario) {
  const auto& way = scenario->target.waypoints;
  const Vector2d ahead = (way[1] - way[0]).normalized();
  const double back = std::atan2(-ahead.y(), -ahead.x());
  world::ChaserSpec& chaser = scenario->chaser;
  chaser.desired_distance = RoundTo(distance, 0.1);
  const world::TargetSpec& target = scenario->target;
  const double height = target.base + 0.5 * target.height + distance * std::tan(kElevation);
  chaser.takeoff_height = std::clamp(RoundTo(height - kStanding, 0.1), 0.9, 1.8);
  for (int tries = 0; tries < 60; ++tries) {
    const double spread = 0.3 + 0.02 * tries, range = distance * random->Uniform(0.9, 1.2);
    const double angle = back + random->Uniform(-spread, spread);
    const Vector2d p = way[0] + Polar(angle, range);
    if (!area.Contains(p, 0.9)) continue;
    const double foot = world::GroundHeight(scenario->world.ground, p.x(), p.y());
    chaser.start = {p.x(), p.y(), foot + kStanding};
    const double away = hidden ? Signed(random, 100.0, 180.0) : random->Uniform(-8.0, 8.0);
    const double yaw = (angle + kPi) * 180.0 / kPi + away;
    chaser.yaw_deg = std::round(std::remainder(yaw, 360.0));
    return true;
  }
  return false;
}

}  // namespace chase::worlds
