#pragma once

#include "common/world/obstacle.h"
#include "services/mapping/enclosing.h"
#include "services/mapping/voxel_grid.h"

namespace chase::mapping {

/// Distance in plan from p along the unit vector d, at most `most` m, until a column with something
/// settled between the heights `low` and `high` (frame W, m).
double FreeWay(const Eigen::Vector2d& p, const Eigen::Vector2d& d, double most, double low,
               double high, VoxelGrid* grid);

/// The same for a body of this outline: the farthest of the ways of its front's middle and of both
/// of its sides, since one that only brushes against something goes on beside it.
double FreeWay(const Ellipse& outline, const Eigen::Vector2d& d, double most, double low,
               double high, VoxelGrid* grid);

/// A mover that goes on at its velocity until it has gone `way` m and stands from then on: the
/// Bernstein polynomial of that motion over the forecast, which never goes farther (its
/// coefficients bound it) and has the mover's velocity at its start if that leaves the first
/// quarter free.
void StopAfter(double way, world::Obstacle* mover);

}  // namespace chase::mapping
