#pragma once

#include <random>
#include <vector>

#include "common/world/plan_check.h"
#include "test/unit/planning_instances.h"

namespace chase::control::test {

using Random = std::mt19937;

inline double Uniform(Random& g, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(g);
}

/// A plan of the planner's, the obstacles that it was made for, and what control asks of it.
struct Case {
  unsigned seed = 0;
  world::Claim claim;
  std::vector<world::Obstacle> obstacles;
  world::LeastClaim least;
};

/// Half of the obstacles are uncertain, a third are boxes, a third upright cylinders.
inline Case MakeCase(unsigned seed, int n_obstacles = 12) {
  const planning::PlannerConfig config;
  planning::InstanceSpec spec;
  spec.horizon = 2.5;
  spec.n_obstacles = n_obstacles;
  Case c;
  c.seed = seed;
  planning::PlanRequest request = planning::InstanceGenerator(config, spec).Make(seed);
  request.target_sigma = 0.02;
  for (world::Obstacle& o : request.obstacles) {
    const Eigen::Vector3d half = o.shape.diagonal().cwiseInverse().cwiseSqrt();
    if (o.id % 3 == 1) o.solid = world::Obstacle::Solid::kBox, o.half = half / std::sqrt(3.0);
    if (o.id % 3 == 2) {
      o.solid = world::Obstacle::Solid::kCylinder;
      o.half = {0.6 * half.x(), 0.6 * half.x(), 0.6 * half.z()};
    }
    if (o.solid != world::Obstacle::Solid::kEllipsoid)
      o.shape = (3.0 * o.half.cwiseAbs2()).cwiseInverse().asDiagonal();
    if (o.moving)  // listed a while before
      o.center = o.center.Reparametrised(request.t0 - 0.25, o.center.duration);
    if (o.id % 2) o.position_covariance = 4e-4 * Eigen::Matrix3d::Identity();
    if (o.id % 4 == 1) o.velocity_covariance = 1e-3 * Eigen::Matrix3d::Identity();
  }
  const planning::PlanResult plan = planning::MakePlanner("chase", config)->Plan(request);
  c.obstacles = request.obstacles;
  c.least = {config.hard_radius(), config.sigmas, false};
  c.claim.position = plan.trajectory;
  c.claim.target = request.target;
  c.claim.stop = plan.stop;
  c.claim.proofs = plan.proofs;
  c.claim.stop_proofs = plan.stop_proofs;
  c.claim.hard_radius = config.hard_radius();
  c.claim.sigmas = config.sigmas;
  c.claim.certified = plan.certified_clearance >= 0.0;
  c.claim.last_resort = plan.verdict == planning::Verdict::kBrake ||
                        plan.verdict == planning::Verdict::kWait ||
                        plan.verdict == planning::Verdict::kMitigate;
  c.claim.starts_inside = c.claim.last_resort || plan.verdict == planning::Verdict::kEscape;
  return c;
}

}  // namespace chase::control::test
