#pragma once

#include <cmath>

#include "common/world/forecast.h"
#include "common/world/random.h"
#include "services/planning/resting.h"
#include "test/unit/planning_claim.h"

namespace chase::planning {

using Eigen::Vector3d;
using world::Random;

inline constexpr int kInstants = 200;

inline Vector3d RandomVector(Random* random, double x, double y, double z) {
  const double a = random->Uniform(-x, x), b = random->Uniform(-y, y);
  return {a, b, random->Uniform(-z, z)};
}

/// An upright cylinder that stands, or walks.
inline world::Obstacle RandomCylinder(Random* random, int id, const Vector3d& at) {
  world::Obstacle o;
  o.id = id;
  o.moving = random->Uniform() < 0.5;
  o.solid = world::Obstacle::Solid::kCylinder;
  const double radius = random->Uniform(0.1, 0.6);
  o.half = {radius, radius, random->Uniform(0.5, 2.0)};
  o.shape = (2.0 * o.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  o.center = {0.0, 1.0, Eigen::MatrixXd::Zero(o.moving ? 2 : 1, 3)};
  o.center.coefficients.row(0) = at.transpose();
  if (o.moving) o.center.coefficients.row(1) = RandomVector(random, 1.5, 1.5, 0.0).transpose();
  return o;
}

inline double Distance(const world::Obstacle& o, const Vector3d& p, double t) {
  const Vector3d d = p - o.center.Position(t);
  if (o.solid == world::Obstacle::Solid::kEllipsoid) return d.norm() - o.half.x();
  const double across = d.head<2>().norm() - o.half.x(), above = std::abs(d.z()) - o.half.z();
  return std::hypot(std::max(0.0, across), std::max(0.0, above)) +
         std::min(0.0, std::max(across, above));
}

/// Fast, at a height that no limit is near to, among one to six cylinders that leave the start
/// free.
inline PlanRequest RandomRequest(const PlannerConfig& c, unsigned seed) {
  Random random(seed, 5);
  PlanRequest request;
  request.t0 = random.Uniform(0.0, 2.0);
  request.start.p = {0.0, 0.0, random.Uniform(1.4, 1.6)};
  request.start.v = RandomVector(&random, 2.5, 2.5, 0.3);
  request.start.a = RandomVector(&random, 2.0, 2.0, 0.3);
  // Near by, as often as not: to rest it need not keep off what is not listed, nor look at it.
  const double height = seed % 2 ? 1.2 : 50.0;
  request.target = world::Trajectory::Constant({0.3, 0.3, height}, 0.0, 5.0);
  const int n = 1 + static_cast<int>(random.Next() % 6);
  while (static_cast<int>(request.obstacles.size()) < n) {
    const int id = static_cast<int>(request.obstacles.size());
    const auto o =
        RandomCylinder(&random, id, RandomVector(&random, 3.0, 3.0, 1.0) + Vector3d(0.0, 0.0, 1.5));
    const double room = c.hard_radius() + c.safety_margin + 0.01;
    if (Distance(o, request.start.p, request.t0) > room) request.obstacles.push_back(o);
  }
  return request;
}

/// The curve of degree 4 that continues the start and comes to rest at T without acceleration.
inline world::Trajectory Braking(const PlanRequest& request, double T) {
  const world::State& s = request.start;
  world::Trajectory way{request.t0, T, Eigen::MatrixXd::Zero(5, 3)};
  auto& c = way.coefficients;
  c.row(0) = s.p.transpose();
  c.row(1) = T * s.v.transpose();
  c.row(2) = T * T / 2.0 * s.a.transpose();
  c.row(3) = -c.row(1) - 4.0 / 3.0 * c.row(2);
  c.row(4) = (c.row(1) + c.row(2)) / 2.0;
  return way;
}

/// Least of what is left of distances, speed and acceleration, the last two as shares.
inline double Room(const PlannerConfig& c, const PlanRequest& request,
                   const world::Trajectory& way) {
  const double speed = std::max(c.max_speed, request.start.v.norm());
  const double acceleration = std::max(c.max_acceleration, request.start.a.norm());
  double least = HUGE_VAL;
  for (int i = 0; i <= kInstants; ++i) {
    const double t = way.start + way.duration * i / kInstants;
    for (const world::Obstacle& o : request.obstacles)
      least = std::min(least, Distance(o, way.Position(t), t) - c.hard_radius() - c.safety_margin);
    if (i == 0) continue;  // what the start has is allowed
    least = std::min(least, 1.0 - way.Velocity(t).norm() / speed);
    least = std::min(least, 1.0 - way.Acceleration(t).norm() / acceleration);
  }
  return least;
}

}  // namespace chase::planning
