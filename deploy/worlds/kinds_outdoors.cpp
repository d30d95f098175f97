#include "deploy/worlds/kinds.h"

namespace chase::worlds {

using Eigen::Vector2d;
using world::Scenario;

namespace {

/// The generator of the scenario format grows the trees: the file stays short.
world::ForestSpec Grown(const Area& area, int count, double gap, double clearance, Random* random) {
  world::ForestSpec forest;
  forest.count = count;
  forest.min = area.min;
  forest.max = area.max;
  forest.gap = gap;
  forest.path_clearance = clearance;
  forest.seed = Whole(random, 1, 999999);
  return forest;
}

/// A large box that cuts across the target's way, ahead of it, at a steady pace.
world::MoverSpec Crossing(const Scenario& scenario, Random* random) {
  const auto path = world::TargetMotion(scenario);
  const double ahead = random->Uniform(1.5, 2.5);  // s before the target is there
  const double t = random->Uniform(8.0, std::max(8.5, scenario.duration_s - 6.0));
  const Vector2d there = path.Position(t + ahead), way = path.Direction(t + ahead);
  const double speed = random->Uniform(2.0, 4.0);
  const double angle = std::atan2(way.y(), way.x()) + Signed(random, 1.1, 2.0);
  const double height = random->Uniform(1.2, 1.6), half = 4.0 * speed;
  world::MoverSpec mover;
  mover.size = {random->Uniform(1.8, 3.0), random->Uniform(0.8, 1.2), height};
  for (const double side : {-1.0, 1.0}) {
    const Vector2d p = there + Polar(angle, side * half);
    const double foot = world::GroundHeight(scenario.world.ground, there.x(), there.y());
    mover.waypoints.emplace_back(p.x(), p.y(), foot + 0.3 + 0.5 * height);
    mover.times.push_back(t + 4.0 * side);
  }
  return mover;
}

}  // namespace

std::optional<Scenario> Forest(const Options& options, Random* random) {
  const Area area = Centred(random->Uniform(70.0, 100.0), random->Uniform(50.0, 70.0));
  Scenario scenario;
  scenario.world.ground.roughness = random->Uniform(0.05, 0.2);
  scenario.world.ground.wavelength = random->Uniform(7.0, 12.0);
  const TourPlan plan{5.0, 8.0, random->Uniform(3.2, 4.0), 24};
  const TargetLimits limits{1.0, 3.0, 0.8, 2.0, 7.0};
  if (!SendAround(area, plan, limits, options, random, &scenario)) return std::nullopt;
  for (int i = Whole(random, 0, 2); i > 0; --i)
    scenario.movers.push_back(Crossing(scenario, random));
  const Vector2d size = area.max - area.min;
  const int count = static_cast<int>(size.x() * size.y() * random->Uniform(0.06, 0.072));
  scenario.world.forest = Grown(area, count, 2.5, random->Uniform(1.1, 1.4), random);
  scenario.wind = DrawWind(random);
  return scenario;
}

std::optional<Scenario> Grove(const Options& options, Random* random) {
  const Area area = Centred(56.0, 44.0);
  Scenario scenario;
  scenario.world.ground.roughness = random->Uniform(0.0, 0.3);
  scenario.world.ground.wavelength = random->Uniform(6.0, 12.0);
  const TourPlan plan{4.0, 5.0, random->Uniform(2.8, 4.0), 16};
  if (!SendAround(area, plan, {0.5, 3.0, 0.8, 1.0, 5.0}, options, random, &scenario))
    return std::nullopt;
  const int count = Whole(random, 70, 130);
  scenario.world.forest =
      Grown(area, count, random->Uniform(1.2, 2.5), random->Uniform(0.9, 1.3), random);
  scenario.wind = DrawWind(random);
  return scenario;
}

std::optional<Scenario> Park(const Options& options, Random* random) {
  const Area area = Centred(random->Uniform(40.0, 60.0), random->Uniform(30.0, 44.0));
  Scenario scenario;
  scenario.world.ground.roughness = random->Uniform(0.0, 0.1);
  const TourPlan plan{3.0, 4.0, random->Uniform(2.6, 3.8), 14};
  if (!SendAround(area, plan, {0.5, 2.5, 0.8, 1.0, 5.0}, options, random, &scenario))
    return std::nullopt;
  const KeptFree free(scenario, 1.0);
  Placer placer(area, free, random);
  placer.Boxes(Whole(random, 3, 8), 1.0, {6.0, 0.7, 1.3}, 0.3, true, &scenario);     // hedges
  placer.Boxes(Whole(random, 4, 10), 1.0, {1.6, 0.5, 0.45}, 0.1, false, &scenario);  // benches
  placer.Trees(Whole(random, 20, 60), 1.5, &scenario);
  scenario.wind = DrawWind(random);
  return scenario;
}

std::optional<Scenario> Field(const Options& options, Random* random) {
  const Area area = Centred(60.0, 60.0);
  Scenario scenario;
  scenario.world.ground.roughness = random->Uniform(0.0, 0.1);
  const TourPlan plan{4.0, 6.0, random->Uniform(2.8, 4.0), 12};
  if (!SendAround(area, plan, {0.5, 3.0, 0.8, 1.0, 6.0}, options, random, &scenario))
    return std::nullopt;
  const KeptFree free(scenario, 1.2);
  Placer(area, free, random).Trees(10, 3.0, &scenario);
  scenario.wind = DrawWind(random);
  return scenario;
}

std::optional<Scenario> Street(const Options& options, Random* random) {
  const double length = random->Uniform(50.0, 80.0), height = random->Uniform(4.0, 8.0);
  const Area area = Centred(length, 12.0);
  Scenario scenario;
  for (const double y : {-6.1, 6.1})
    scenario.world.walls.push_back({{-0.5 * length, y}, {0.5 * length, y}, height, 0.2});
  const TourPlan plan{2.8, 4.0, random->Uniform(2.6, 3.6), 14};
  if (!SendAround(area, plan, {0.5, 3.0, 0.8, 0.8, 3.0}, options, random, &scenario))
    return std::nullopt;
  const KeptFree free(scenario, 0.9);
  const Area right{area.min, {area.max.x(), -3.8}}, left{{area.min.x(), 3.8}, area.max};
  for (const Area& side : {left, right}) {
    Placer placer(side, free, random);
    for (int tries = 0; tries < 60; ++tries) {  // parked along the wall
      const bool van = Chance(random, 0.25);
      world::BoxSpec car;
      car.size = {random->Uniform(3.9, 4.8), random->Uniform(1.7, 1.9),
                  van ? random->Uniform(1.9, 2.4) : random->Uniform(1.4, 1.6)};
      const double away = 0.5 * car.size.y() + random->Uniform(0.2, 0.4);
      const double y = side.min.y() > 0.0 ? area.max.y() - away : area.min.y() + away;
      car.center = {random->Uniform(area.min.x() + 3.0, area.max.x() - 3.0), y, 0.5 * car.size.z()};
      if (placer.Take({world::Solid::Kind::kBox, car.center, 0.5 * car.size, 0.0}, 0.2))
        scenario.world.boxes.push_back(car);
    }
    placer.Pillars(Whole(random, 1, 4), 0.5, 0.07, 0.12, 5.0, &scenario);  // lamp posts
  }
  scenario.wind = DrawWind(random);
  return scenario;
}

std::optional<Scenario> Yard(const Options& options, Random* random) {
  const Area area = Centred(random->Uniform(40.0, 60.0), random->Uniform(30.0, 45.0));
  Scenario scenario;
  const TourPlan plan{2.5, 5.0, random->Uniform(2.6, 3.6), 12};
  if (!SendAround(area, plan, {0.5, 2.5, 0.8, 0.8, 3.0}, options, random, &scenario))
    return std::nullopt;
  const KeptFree free(scenario, 1.0);
  Placer placer(area, free, random);
  placer.Boxes(Whole(random, 1, 4), 0.4, {12.19, 2.44, 2.59}, 0.0, true, &scenario);
  placer.Boxes(Whole(random, 3, 8), 0.4, {6.06, 2.44, 5.18}, 0.0, true, &scenario);  // two high
  placer.Boxes(Whole(random, 5, 12), 0.4, {6.06, 2.44, 2.59}, 0.0, true, &scenario);
  placer.Boxes(Whole(random, 0, 8), 0.4, {1.2, 1.0, 1.0}, 0.2, false, &scenario);  // crates
  scenario.wind = DrawWind(random);
  return scenario;
}

std::optional<Scenario> Slope(const Options& options, Random* random) {
  const Area area = Centred(56.0, 44.0);
  Scenario scenario;
  const double rise = std::tan(random->Uniform(4.0, 12.0) * kPi / 180.0);
  const Vector2d uphill = Polar(random->Uniform(0.0, 2.0 * kPi), rise);
  // As the file will have it: at 25 m the fourth decimal is a centimetre of height.
  scenario.world.ground.slope = {RoundTo(uphill.x(), 1e-3), RoundTo(uphill.y(), 1e-3)};
  scenario.world.ground.roughness = random->Uniform(0.0, 0.1);
  const TourPlan plan{4.0, 4.0, random->Uniform(2.8, 4.0), 14};
  if (!SendAround(area, plan, {0.5, 2.5, 0.8, 1.0, 5.0}, options, random, &scenario))
    return std::nullopt;
  const KeptFree free(scenario, 1.1);
  Placer placer(area, free, random);
  placer.Boulders(Whole(random, 3, 10), 1.0, &scenario);
  placer.Trees(Whole(random, 15, 40), 2.0, &scenario);
  scenario.wind = DrawWind(random);
  return scenario;
}

}  // namespace chase::worlds
