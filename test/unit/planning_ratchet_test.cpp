#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "services/planning/field_of_view.h"
#include "services/planning/planner.h"

// Chains of plans, each from where the one before is left: no limit gives way bit by bit.

namespace chase::planning {
namespace {

using Eigen::Vector3d;

constexpr int kReplans = 300;
constexpr double kStep = 0.08;      // s between replans
constexpr double kRounding = 1e-5;  // of a limit

world::Obstacle Pillar(int id, double x, double y, double radius) {
  world::Obstacle o;
  o.id = id;
  o.center = world::Trajectory::Constant({x, y, 1.0}, 0.0, 1.0);
  o.solid = world::Obstacle::Solid::kCylinder;
  o.half = {radius, radius, 3.0};
  o.shape = o.half.cwiseAbs2().cwiseInverse().asDiagonal();
  return o;
}

/// Of what was flown. The target: nearest distance, and largest tangents off the level, in the
/// world and of the image of a body whose heading follows it.
struct Extremes {
  double clearance = HUGE_VAL, speed = 0.0, acceleration = 0.0, low = HUGE_VAL, high = -HUGE_VAL;
  double near = HUGE_VAL, slope = 0.0, below = -HUGE_VAL, above = -HUGE_VAL;
  int uncertified = 0, blind = 0;

  void Add(const world::State& s, const Vector3d& target,
           const std::vector<world::Obstacle>& obstacles) {
    for (const world::Obstacle& o : obstacles)
      clearance = std::min(clearance, (s.p - o.center.Position(0.0)).head<2>().norm() - o.half.x());
    speed = std::max(speed, s.v.norm());
    acceleration = std::max(acceleration, s.a.norm());
    low = std::min(low, s.p.z());
    high = std::max(high, s.p.z());
    const Vector3d r = target - s.p;
    near = std::min(near, r.norm());
    slope = std::max(slope, std::abs(r.z()) / r.head<2>().norm());
    const double seen = SeenBelow(r, s.v, s.a, PlannerConfig().drag);
    below = std::max(below, seen);
    above = std::max(above, -seen);
  }
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
    e.blind += plan.verdict >= Verdict::kSafeOnly;
    for (double t = request.t0; t <= request.t0 + kStep; t += 0.01)
      e.Add(plan.trajectory.At(std::min(t, plan.trajectory.end())), p + t * v, obstacles);
    const double next = request.t0 + kStep;
    request.start = plan.trajectory.At(std::min(next, plan.trajectory.end()));
    if (next >= plan.trajectory.end())
      request.start.v = request.start.a = request.start.j = Vector3d::Zero();
    request.running = plan.trajectory;
    request.stop = plan.stop;
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
  EXPECT_LE(e.speed, config.max_speed * (1.0 + kRounding));
  EXPECT_GT(e.speed, 0.6 * config.max_speed);
  EXPECT_LE(e.acceleration, config.max_acceleration * (1.0 + kRounding));
}

/// Where the planner wants to be is beyond the limit, or beside it at best, all the time. A
/// quantity that is not to exceed `most` of what was flown comes to within a tenth of it, and each
/// plan may take a millionth more than its start has.
void Push(const char* what, const PlannerConfig& config, double height, double start_height,
          double most, double (*of)(const Extremes&)) {
  double largest = -HUGE_VAL;
  for (const Vector3d& v : {Vector3d(0, 0, 0), Vector3d(0.5, 0, 0), Vector3d(0.3, 0.6, 0)}) {
    const Extremes e = Chain(config, {}, {2.5, 0.0, height}, v, {0.0, 0.0, start_height});
    EXPECT_EQ(e.blind, 0) << what << " " << v.transpose();
    largest = std::max(largest, of(e));
  }
  EXPECT_LE(largest, most + 1e-6 * kReplans * (1.0 + std::abs(most))) << what;
  EXPECT_GE(largest, most - 0.1 * std::abs(most)) << what << ": the limit is felt";
}

TEST(Ratchet, APlaceBeyondALimitIsNotComeNearerToBitByBit) {
  constexpr double kDegree = M_PI / 180.0;
  PlannerConfig c;
  c.desired_distance = 0.7;
  Push("distance", c, 0.8, 1.2, -c.min_distance, [](const Extremes& e) { return -e.near; });
  c = {};
  c.max_elevation_deg = 10.0;
  Push("elevation", c, 0.6, 0.8, std::tan(10.0 * kDegree),
       [](const Extremes& e) { return e.slope; });
  c = {};
  c.view_down_deg = 12.0;
  Push("lower edge", c, 0.6, 0.75, std::tan(12.0 * kDegree),
       [](const Extremes& e) { return e.below; });
  c = {};
  c.elevation_low_deg = -14.0;
  c.elevation_high_deg = 0.0;
  c.view_up_deg = 8.0;
  Push("upper edge", c, 2.3, 2.3, std::tan(8.0 * kDegree),
       [](const Extremes& e) { return e.above; });
  c = {};
  Push("least height", c, 0.2, 1.2, -c.z_min, [](const Extremes& e) { return -e.low; });
  Push("greatest height", c, 3.3, 3.4, c.z_max, [](const Extremes& e) { return e.high; });
}

TEST(Ratchet, HeightsHoldAgainstADroneThatRisesOrSinksTowardsThem) {
  const PlannerConfig c;
  for (const Vector3d& v : {Vector3d(0, 0, 0), Vector3d(0.5, 0, 0), Vector3d(0.3, 0.6, 0)})
    for (const double height : {0.2, 3.3}) {
      const Extremes e = Chain(c, {}, {2.5, 0.0, height}, v, {0.0, 0.0, 2.0});
      EXPECT_GE(e.low, c.z_min - 1e-6 * kReplans) << height << " " << v.transpose();
      EXPECT_LE(e.high, c.z_max + 1e-6 * kReplans) << height << " " << v.transpose();
      EXPECT_EQ(e.uncertified, 0) << height << " " << v.transpose();
    }
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
    EXPECT_LE(plan.trajectory.Velocity(t).norm(), 1.5 * (1.0 + kRounding)) << t;
}

}  // namespace
}  // namespace chase::planning
