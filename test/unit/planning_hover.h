#pragma once

#include <algorithm>
#include <cmath>

#include "services/planning/planner.h"

// Movers for a drone that hovers, and sampled distances.

namespace chase::planning {

using Eigen::Vector3d;

/// An upright cylinder that moves at v.
inline world::Obstacle Cylinder(int id, const Vector3d& p, const Vector3d& v, double radius,
                                double half_height) {
  world::Obstacle o;
  o.id = id;
  o.moving = true;
  o.center = {0.0, 1.0, Eigen::MatrixXd::Zero(2, 3)};
  o.center.coefficients << p.transpose(), v.transpose();
  o.solid = world::Obstacle::Solid::kCylinder;
  o.half = {radius, radius, half_height};
  o.shape = o.half.cwiseAbs2().cwiseInverse().asDiagonal();
  return o;
}

/// A wall across x that moves along it.
inline world::Obstacle Wall(int id, double x, double speed) {
  world::Obstacle o = Cylinder(id, {x, 0.0, 1.0}, {speed, 0.0, 0.0}, 1.0, 1.0);
  o.solid = world::Obstacle::Solid::kBox;
  o.half = {0.1, 20.0, 20.0};
  o.shape = (3.0 * o.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  return o;
}

/// From the surface, negative inside.
inline double Distance(const world::Obstacle& o, const Vector3d& p, double t) {
  const Vector3d d = p - o.center.Position(t);
  if (o.solid == world::Obstacle::Solid::kEllipsoid) return d.norm() - o.half.x();
  const bool box = o.solid == world::Obstacle::Solid::kBox;
  const Vector3d beyond =
      box ? Vector3d(d.cwiseAbs() - o.half)
          : Vector3d(d.head<2>().norm() - o.half.x(), std::abs(d.z()) - o.half.z(), -HUGE_VAL);
  return beyond.cwiseMax(0.0).norm() + std::min(0.0, beyond.maxCoeff());
}

inline double LeastDistance(const world::Obstacle& o, const world::Trajectory& way) {
  double least = HUGE_VAL;
  for (int i = 0; i <= 200; ++i) {
    const double t = way.start + way.duration * i / 200.0;
    least = std::min(least, Distance(o, way.Position(t), t));
  }
  return least;
}

/// A drone that hovers 2.5 m behind a target that walks away from it.
inline PlanRequest Hover() {
  PlanRequest r;
  r.horizon = 2.5;
  r.start.p = {-2.5, 0.0, 1.4};
  r.target = {0.0, 2.5, Eigen::MatrixXd::Zero(2, 3)};
  r.target.coefficients << 0.0, 0.0, 0.8, 1.5, 0.0, 0.0;
  return r;
}

}  // namespace chase::planning
