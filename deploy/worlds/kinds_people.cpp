#include "deploy/worlds/kinds.h"
#include "deploy/worlds/walkers.h"

namespace chase::worlds {

using world::Scenario;

std::optional<Scenario> Crowd(const Options& options, Random* random) {
  const Area area = Centred(random->Uniform(26.0, 38.0), random->Uniform(20.0, 28.0));
  Scenario scenario;
  for (const double y : {area.min.y() - 0.1, area.max.y() + 0.1})
    scenario.world.walls.push_back({{area.min.x(), y}, {area.max.x(), y}, 5.0, 0.2});
  const TourPlan plan{3.0, 3.5, random->Uniform(2.2, 3.0), 12};
  if (!SendAround(area, plan, {0.5, 1.8, 0.7, 0.6, 2.5}, options, random, &scenario))
    return std::nullopt;
  const KeptFree free(scenario, 1.0);
  Placer placer(area, free, random);
  placer.Pillars(Whole(random, 1, 6), 2.0, 0.15, 0.4, 4.0, &scenario);
  placer.Boxes(Whole(random, 0, 4), 1.0, {1.6, 0.5, 0.45}, 0.1, false, &scenario);  // benches
  if (!AddWalkers(Whole(random, 4, 8), area, random, &scenario)) return std::nullopt;
  scenario.wind = DrawWind(random);
  return scenario;
}

std::optional<Scenario> Mixed(const Options& options, Random* random) {
  const Area area = Centred(random->Uniform(36.0, 48.0), random->Uniform(28.0, 36.0));
  Scenario scenario;
  scenario.world.ground.roughness = random->Uniform(0.0, 0.05);
  const TourPlan plan{3.0, 4.0, random->Uniform(2.5, 3.5), 12};
  if (!SendAround(area, plan, {0.5, 2.2, 0.8, 0.8, 4.0}, options, random, &scenario))
    return std::nullopt;
  const KeptFree free(scenario, 1.0);
  Placer placer(area, free, random);
  for (int i = 0, tries = 0; i < 4 && tries < 200; ++tries) {
    const Eigen::Vector2d from = area.Point(random, 0.5);
    const Eigen::Vector2d to =
        from + Polar(0.5 * kPi * Whole(random, 0, 3), random->Uniform(3.0, 9.0));
    const Eigen::Vector2d middle = 0.5 * (from + to), half = 0.5 * (to - from);
    const world::Solid wall{world::Solid::Kind::kBox,
                            {middle.x(), middle.y(), 1.0},
                            {half.norm(), 0.1, 1.0},
                            std::atan2(half.y(), half.x())};
    if (!area.Contains(to, 0.5) || !placer.Take(wall, 0.0)) continue;
    scenario.world.walls.push_back({from, to, random->Uniform(1.8, 3.0), 0.2});
    ++i;
  }
  placer.Boxes(Whole(random, 3, 9), 0.8, {2.0, 1.5, 1.5}, 0.5, false, &scenario);
  placer.Pillars(Whole(random, 0, 4), 0.8, 0.15, 0.4, 3.0, &scenario);
  placer.Trees(Whole(random, 10, 25), 1.2, &scenario);
  if (!AddWalkers(Whole(random, 2, 4), area, random, &scenario)) return std::nullopt;
  scenario.wind = DrawWind(random);
  return scenario;
}

}  // namespace chase::worlds
