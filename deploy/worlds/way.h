#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/world/scenario.h"
#include "deploy/worlds/layout.h"

namespace chase::worlds {

/// Places in the area at least `apart` from each other, at most `count`.
std::vector<Eigen::Vector2d> Nodes(const Area& area, int count, double apart, Random* random);

/// A walk of about `length` m from node to node, seldom straight back; legs of `leg_min` to
/// three times that, longer where there is no other.
std::vector<Eigen::Vector2d> Tour(const std::vector<Eigen::Vector2d>& nodes, double length,
                                  double leg_min, Random* random);

/// Shape, sizes and how it drives: up to `speed` m/s.
struct TargetLimits {
  double speed_min = 0.5, speed_max = 3.0;
  double largest_carrier = 0.8;  ///< its length, m
  double corner_min = 0.8, corner_max = 3.0;
};
world::TargetSpec DrawTarget(const TargetLimits& limits, Random* random);

/// Stops and turns on the spot at some of the waypoints; a start that waits while the chaser
/// searches.
void AddStops(bool wait_at_start, Random* random, world::TargetSpec* target);

/// Radius in plan around target and carrier, m.
double TargetReach(const world::TargetSpec& target);

/// Puts the chaser behind the target's start, `distance` away within `area`, facing it or, when
/// hidden, facing away; sets the take-off height from where the target is seen a little from above.
/// False when there is no place for it.
bool PlaceChaser(const Area& area, double distance, bool hidden, Random* random,
                 world::Scenario* scenario);

}  // namespace chase::worlds
