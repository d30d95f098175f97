#pragma once

#include <optional>

#include "common/world/scenario.h"
#include "deploy/worlds/draw.h"
#include "deploy/worlds/way.h"

namespace chase::worlds {

struct Options {
  double duration = 45.0;     ///< of the mission, s
  bool hidden_start = false;  ///< the target is out of the image at the start
};

// Each draws world, movers, the target's way and the chaser's place; nothing when the draw does not
// work out.
using Draw = std::optional<world::Scenario> (*)(const Options& options, Random* random);

std::optional<world::Scenario> Hall(const Options& options, Random* random);
std::optional<world::Scenario> Office(const Options& options, Random* random);
std::optional<world::Scenario> Corridor(const Options& options, Random* random);
std::optional<world::Scenario> Forest(const Options& options, Random* random);
std::optional<world::Scenario> Grove(const Options& options, Random* random);
std::optional<world::Scenario> Park(const Options& options, Random* random);
std::optional<world::Scenario> Field(const Options& options, Random* random);
std::optional<world::Scenario> Street(const Options& options, Random* random);
std::optional<world::Scenario> Yard(const Options& options, Random* random);
std::optional<world::Scenario> Slope(const Options& options, Random* random);
std::optional<world::Scenario> Crowd(const Options& options, Random* random);
std::optional<world::Scenario> Mixed(const Options& options, Random* random);

/// Wind outdoors: up to 2.5 m/s with gusts.
world::WindSpec DrawWind(Random* random);

/// The target on a tour through the area, at least `margin` from its edges and long enough for the
/// mission, and the chaser behind it. False when there is no place for the chaser.
struct TourPlan {
  double margin = 2.0, leg_min = 4.0, distance = 3.0;
  int nodes = 9;
};
bool SendAround(const Area& area, const TourPlan& plan, const TargetLimits& limits,
                const Options& options, Random* random, world::Scenario* scenario);

}  // namespace chase::worlds
