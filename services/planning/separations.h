#pragma once

#include <optional>
#include <vector>

#include "common/world/separation.h"
#include "services/planning/problem.h"

namespace chase::planning {

/// Does the plan stay off the obstacles, and its line of sight from `sight_from` on? Obstacles that
/// stand for no solid are not asked about; where the problem has a reach that holds the plan, nor
/// are those that are not near.
/// `first`, if given: index of the obstacle to be asked first, and then of the one that is not kept
/// off, because one plan after the other tends to fail at the same.
bool StaysOff(const Curve& plan, const Problem& problem, double sight_from, int* first = nullptr);

/// The proofs of that for all obstacles; nothing where it does not.
std::optional<std::vector<Proof>> ProveOff(const Curve& plan, const Problem& problem,
                                           double sight_from);

/// The drone's ball, and the target's end of the line of sight with its uncertainty; `share` of the
/// latter.
math::Polynomial TargetRadius(const Problem& problem, double share);
world::Ball DroneBall(const Curve& plan, double radius);
world::Ball TargetBall(const Problem& problem, double share);

}  // namespace chase::planning
