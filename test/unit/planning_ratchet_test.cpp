#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "services/planning/planner.h"

// Chains of plans, each from where the one before is left: no limit gives way bit by bit.

namespace chase::planning {
namespace {

using Eigen::Vector3d;

constexpr int kReplans = 300;
constexpr double kStep = 0.08;  // s between replans

world::Obstacle Pillar(int id, double x, double y, double radius) {
  world::Obstacle o;
  o.id = id;
  o.center = world::Trajectory::Constant({x, y, 1.0}, 0.0, 1.0);
  o.solid = world::Obstacle::Solid::kCylinder;
  o.half = {radius, radius, 3.0};
  o.shape = o.half.cwiseAbs2().cwiseInverse().asDiagonal();
  return o;
}

struct Extremes {
  double clearance = HUGE_VAL, speed = 0.0, acceleration = 0.0;
  int uncertified = 0;
};

/// The drone follows its plans after a target at p + v t.
Extremes Chain(const PlannerConfig& config, const std::vector<world::Obstacle>& obstacles,
               const Vector3d& p, const Vector3d& v, const Vector3d& start) {
  const auto planner = MakePlanner("chase", config);
  PlanRequest request;
  request.horizon = 2.5;
  request.start.p = start;
  request.obstacles = obstacles;
  Extremes e;
  for (int i = 0; i < kReplans; ++i) {
    request.t0 = kStep * i;
    request.target = {request.t0, request.horizon, Eigen::MatrixXd::Zero(2, 3)};
    request.target.coefficients.row(0) = (p + request.t0 * v).transpose();
    request.target.coefficients.row(1) = (request.horizon * v).transpose();
    const PlanResult plan = planner->Plan(request);
    e.uncertified += plan.certified_clearance < 0.0;
    for (double t = request.t0; t <= request.t0 + kStep; t += 0.01) {
      const world::State s = plan.trajectory.At(std::min(t, plan.trajectory.end()));
      e.speed = std::max(e.speed, s.v.norm());
      e.acceleration = std::max(e.acceleration, s.a.norm());
      for (const world::Obstacle& o : obstacles)
        e.clearance =
            std::min(e.clearance, (s.p - o.center.Position(t)).head<2>().norm() - o.half.x());
    }
    const double next = request.t0 + kStep;
    request.start = plan.trajectory.At(std::min(next, plan.trajectory.end()));
    if (next >= plan.trajectory.end())
      request.start.v = request.start.a = request.start.j = Vector3d::Zero();
    request.running = plan.trajectory;
  }
  return e;
}

TEST(Ratchet, ATargetBehindAnObstacleDoesNotPullTheDroneIntoIt) {
  const PlannerConfig config;
  for (const double across : {0.0, 0.3, 0.9}) {
    const Extremes e = Chain(config, {Pillar(1, 0.0, 0.0, 0.4), Pillar(2, 0.0, 1.6, 0.4)},
                             {0.9, across, 0.6}, {0.0, 0.0, 0.0}, {-2.0, 0.1, 1.2});
    EXPECT_GE(e.clearance, config.hard_radius() - 1e-6) << across;
    EXPECT_EQ(e.uncertified, 0) << across;
  }
}

TEST(Ratchet, ATargetThatIsTooFastDoesNotLiftTheLimits) {
  PlannerConfig config;
  config.max_speed = 2.0;
  config.max_acceleration = 2.0;
  const Extremes e = Chain(config, {}, {2.5, 0.0, 0.6}, {6.0, 0.0, 0.0}, {0.0, 0.0, 1.2});
  EXPECT_LE(e.speed, config.max_speed * (1.0 + 1e-5));
  EXPECT_GT(e.speed, 0.6 * config.max_speed);
  EXPECT_LE(e.acceleration, config.max_acceleration * (1.0 + 1e-5));
}

TEST(Ratchet, AStartBeyondALimitOnlyComesBack) {
  PlannerConfig config;
  config.max_speed = 1.0;
  const auto planner = MakePlanner("chase", config);
  PlanRequest request;
  request.horizon = 2.5;
  request.start.p = {0.0, 0.0, 1.2};
  request.start.v = {1.5, 0.0, 0.0};
  request.target = {0.0, 2.5, Eigen::MatrixXd::Zero(2, 3)};
  request.target.coefficients << 2.5, 0.0, 0.6, 2.5, 0.0, 0.0;
  const PlanResult plan = planner->Plan(request);
  for (double t = 0.0; t <= plan.trajectory.duration; t += 0.02)
    EXPECT_LE(plan.trajectory.Velocity(t).norm(), 1.5 * (1.0 + 1e-5)) << t;
}

}  // namespace
}  // namespace chase::planning
