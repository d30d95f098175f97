#include <algorithm>

#include "deploy/worlds/kinds.h"

namespace chase::worlds {

world::WindSpec DrawWind(Random* random) {
  world::WindSpec wind;
  const auto mean = Polar(random->Uniform(0.0, 2.0 * kPi), random->Uniform(0.0, 2.5));
  wind.mean = {mean.x(), mean.y(), 0.0};
  wind.gust = random->Uniform(0.1, 0.8);
  wind.gust_time = random->Uniform(1.0, 3.0);
  return wind;
}

bool SendAround(const Area& area, const TourPlan& plan, const TargetLimits& limits,
                const Options& options, Random* random, world::Scenario* scenario) {
  scenario->duration_s = options.duration;
  scenario->target = DrawTarget(limits, random);
  const Area inner{area.min.array() + plan.margin, area.max.array() - plan.margin};
  const auto nodes = Nodes(inner, plan.nodes, plan.leg_min, random);
  if (nodes.size() < 4) return false;
  const double length = std::max(8.0, scenario->target.speed * options.duration);
  scenario->target.waypoints = Tour(nodes, length, plan.leg_min, random);
  if (scenario->target.waypoints.size() < 3) return false;
  AddStops(options.hidden_start, random, &scenario->target);
  return PlaceChaser(area, plan.distance, options.hidden_start, random, scenario);
}

}  // namespace chase::worlds
