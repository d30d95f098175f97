#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "test/baselines/hierarchical/parameters.h"
#include "test/baselines/pieces.h"

namespace chase::baselines {

/// One polynomial of degree 6 per leg between waypoints at equal times, axes independent: least
/// squared jerk plus pull of the waypoints, position, velocity and acceleration given at the start
/// and continuous at knots, and at `corridor_points` inner instants of each leg within a box around
/// the straight line. Waypoint 0 is the start. Nothing when the quadratic program has no solution.
std::optional<Pieces> SmoothCorridor(const HierarchicalParameters& parameters,
                                     const world::State& start,
                                     const std::vector<Eigen::Vector3d>& waypoints, double t0,
                                     double horizon);

}  // namespace chase::baselines
