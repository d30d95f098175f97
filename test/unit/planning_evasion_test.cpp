#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "services/planning/planner.h"
#include "services/planning/stopping.h"
#include "test/unit/planning_hover.h"

// Ways aside and out of what the drone is in, judged by sampled distances.

namespace chase::planning {
namespace {

/// A ball so large that nearly it is the wall.
world::Obstacle Ball(int id, double x, double speed) {
  constexpr double kRadius = 30.0;
  world::Obstacle o = Wall(id, x - std::copysign(kRadius, speed), speed);
  o.center.coefficients(0, 2) = 1.4;
  o.solid = world::Obstacle::Solid::kEllipsoid;
  o.half.setConstant(kRadius);
  o.shape = o.half.cwiseAbs2().cwiseInverse().asDiagonal();
  return o;
}

/// When the way first comes nearer than `radius`, s; infinite where it never does.
double FirstContact(const world::Obstacle& o, const world::Trajectory& way, double radius) {
  for (double t = way.start; t <= way.end(); t += 0.005)
    if (Distance(o, way.Position(t), t) < radius) return t;
  return HUGE_VAL;
}

TEST(Evasion, WhatCannotBeBrakedForIsEvadedAndCertified) {
  const PlannerConfig config;
  int aside = 0;
  for (const double angle : {0.0, 1.0, 2.5, 4.0}) {
    const Vector3d along(std::cos(angle), std::sin(angle), 0.0);
    PlanRequest request = Hover();
    request.obstacles = {Cylinder(1, request.start.p - 1.3 * along, 1.2 * along, 0.3, 3.0)};
    ASSERT_FALSE(Brake(config, request)) << "it would do to stay";
    const PlanResult plan = RestPlan(config, request);
    EXPECT_EQ(plan.verdict, Verdict::kEscape) << plan.reason;
    EXPECT_GE(plan.certified_clearance, 0.0);
    EXPECT_GE(LeastDistance(request.obstacles[0], plan.trajectory), config.hard_radius() - 1e-6);
    EXPECT_LT(plan.trajectory.Velocity(plan.trajectory.end()).norm(), 1e-6);
    const Vector3d end = plan.trajectory.Position(plan.trajectory.end());
    EXPECT_LT((end - request.start.p).norm(), 1.5) << "not the farthest that is tried";
    aside += plan.reason == "nor is braking";
  }
  EXPECT_EQ(aside, 4);
}

// Whatever place is clear, one near it is tried.
TEST(Evasion, PlacesAsideAreNearToAnyPlace) {
  const std::vector<Vector3d> places = PlacesAside();
  const auto off = [&](const Vector3d& place) {
    double least = HUGE_VAL;
    for (const Vector3d& p : places) least = std::min(least, (p - place).norm());
    return least;
  };
  double most = 0.0;
  for (double r = 0.4; r <= 2.2; r += 0.05)
    for (double angle = 0.0; angle < 2.0 * M_PI; angle += 0.05)
      for (const double rise : {-0.5, -0.2, 0.0, 0.3, 0.5})
        most = std::max(most, off(r * Vector3d(std::cos(angle), std::sin(angle), rise)) /
                                  std::hypot(r, r * rise));
  EXPECT_LT(most, 0.42);
  for (double rise = -1.25; rise <= 1.75; rise += 0.05) {
    EXPECT_LT(off({0.0, 0.0, rise}), std::abs(rise) < 0.26 ? 0.51 : 0.26) << rise;
  }
  EXPECT_TRUE(std::is_sorted(places.begin(), places.end(), [](const auto& a, const auto& b) {
    return a.norm() < b.norm() - 1e-12;
  }));
}

// Braking is certified for as long as it takes; where somebody comes soon after that it is too late
// for a way aside then.
TEST(Evasion, StepsAsideWhileThereIsAWay) {
  const PlannerConfig config;
  for (const double beside : {0.0, 0.2, 3.0}) {
    PlanRequest request = Hover();
    const Vector3d at = request.start.p + Vector3d(-2.2, beside, 0.0);
    request.obstacles = {Cylinder(1, at, {1.2, 0.0, 0.0}, 0.3, 3.0)};
    ASSERT_TRUE(Brake(config, request));
    const PlanResult plan = RestPlan(config, request);
    EXPECT_GE(plan.certified_clearance, 0.0) << beside;
    EXPECT_EQ(plan.verdict, beside < 1.0 ? Verdict::kEscape : Verdict::kBrake) << plan.reason;
    const Vector3d end = plan.trajectory.Position(plan.trajectory.end());
    const double from = plan.trajectory.end();
    EXPECT_GE(LeastDistance(request.obstacles[0],
                            world::Trajectory::Constant(end, from, request.t0 + 2.0 - from)),
              config.hard_radius() - 1e-6);
  }
}

TEST(Evasion, StaysBesideWhatStandsHoweverTheFrameDrifts) {
  const PlannerConfig config;
  PlanRequest request = Hover();
  world::Obstacle wall = Wall(1, request.start.p.x() + config.hard_radius() + 0.25, 0.0);
  wall.moving = false;
  wall.velocity_covariance.diagonal().setConstant(0.05 * 0.05);
  request.obstacles = {wall};
  ASSERT_TRUE(Brake(config, request));
  const PlanResult plan = RestPlan(config, request);
  EXPECT_EQ(plan.verdict, Verdict::kBrake) << plan.reason;
  EXPECT_GE(plan.certified_clearance, 0.0);
}

TEST(Evasion, SaysThatItLeadsIntoWhatNobodyHasLookedInto) {
  PlanRequest request = Hover();
  request.obstacles = {
      Cylinder(1, request.start.p - Vector3d(1.3, 0.0, 0.0), {1.2, 0.0, 0.0}, 0.3, 3.0)};
  for (const bool seen : {true, false}) {
    request.unseen.clear();
    for (int i = 0; !seen && i < 12; ++i) {
      const double angle = M_PI / 6.0 * i;
      const Vector3d away(std::cos(angle), std::sin(angle), 0.0);
      request.unseen.push_back(
          Cylinder(100 + i, request.start.p + 1.1 * away, Vector3d::Zero(), 0.4, 3.0));
    }
    const PlanResult plan = RestPlan(PlannerConfig(), request);
    EXPECT_EQ(plan.verdict, Verdict::kEscape) << plan.reason;
    EXPECT_EQ(plan.reason.find("nobody has looked") == std::string::npos, seen) << plan.reason;
  }
}

TEST(Evasion, WhereNothingCanBeCertifiedTheContactComesLaterThanAtRest) {
  const PlannerConfig config;
  for (int i = 0; i < 6; ++i) {
    const double speed = std::vector<double>{2.0, 4.0, -3.0}[static_cast<size_t>(i % 3)];
    PlanRequest request = Hover();
    const double x = request.start.p.x() - 0.5 * speed;
    request.obstacles = {i < 3 ? Wall(1, x, speed) : Ball(1, x, speed)};
    const PlanResult plan = RestPlan(config, request);
    EXPECT_EQ(plan.verdict, Verdict::kMitigate) << plan.reason;
    EXPECT_LT(plan.certified_clearance, 0.0);
    EXPECT_TRUE(plan.proofs.empty());
    EXPECT_LT((plan.trajectory.Position(0.0) - request.start.p).norm(), 1e-9);
    const world::Trajectory stays =
        world::Trajectory::Constant(request.start.p, 0.0, plan.trajectory.duration);
    EXPECT_GT((plan.trajectory.Position(plan.trajectory.end()) - request.start.p).norm(), 0.3);
    EXPECT_GT(FirstContact(request.obstacles[0], plan.trajectory, config.drone_radius),
              FirstContact(request.obstacles[0], stays, config.drone_radius))
        << speed;
  }
}

// The ceiling counts as a static obstacle: what comes is not passed above it.
TEST(Evasion, TheLeastHarmIsBelowTheCeiling) {
  const PlannerConfig config;
  for (const double above : {0.1, 0.3, 0.5}) {
    PlanRequest request = Hover();
    request.start.p.z() = config.z_max - 0.3;
    world::Obstacle wall = Wall(1, request.start.p.x() - 1.0, 2.0);
    wall.center.coefficients(0, 2) = request.start.p.z() + above - wall.half.z();
    request.obstacles = {wall};
    const PlanResult plan = RestPlan(config, request);
    EXPECT_EQ(plan.verdict, Verdict::kMitigate) << plan.reason;
    for (double t = 0.0; t < plan.trajectory.end(); t += 0.05)
      EXPECT_LT(plan.trajectory.Position(t).z(), config.z_max + 1e-3) << above << " " << t;
  }
}

// Where the drone is nothing stands; what the map has there it need not flee from.
TEST(Evasion, InsideOfWhatStandsItOnlyBrakes) {
  for (const double speed : {0.0, 1.0, -1.0}) {  // farther in, and out
    PlanRequest request = Hover();
    request.start.v.x() = speed;
    request.obstacles = {
        Cylinder(1, request.start.p + Vector3d(1.0, 0.5, 0.0), Vector3d::Zero(), 6.0, 3.0)};
    const PlanResult plan = RestPlan(PlannerConfig(), request);
    EXPECT_EQ(plan.verdict, Verdict::kBrake) << plan.reason;
    for (double t = 0.0; t < plan.trajectory.duration; t += 0.05)
      EXPECT_LE(plan.trajectory.Velocity(t).norm(), std::abs(speed) + 1e-9) << t;
  }
}

// As fast as is allowed and still faster soon: no way keeps the limit, and it brakes all the same.
TEST(Evasion, WhereNoWayKeepsTheLimitsItGoesOnFromItsStart) {
  const PlannerConfig config;
  PlanRequest request = Hover();
  request.start.v.x() = 0.99 * config.max_speed;
  request.start.a.x() = 0.9 * config.max_acceleration;
  ASSERT_FALSE(Brake(config, request));
  const PlanResult plan = RestPlan(config, request);
  EXPECT_EQ(plan.verdict, Verdict::kMitigate) << plan.reason;
  EXPECT_LT(plan.certified_clearance, 0.0);
  EXPECT_LT((plan.trajectory.Velocity(request.t0) - request.start.v).norm(), 1e-9);
  EXPECT_LT((plan.trajectory.Acceleration(request.t0) - request.start.a).norm(), 1e-9);
  EXPECT_TRUE(world::EndsAtRest(plan.trajectory));
}

TEST(Evasion, AStartThatIsNotFiniteStaysWhereItIs) {
  PlanRequest request = Hover();
  request.t0 = 3.0;
  request.start.v.x() = std::nan("");
  const PlanResult plan = RestPlan(PlannerConfig(), request);
  EXPECT_LT(plan.certified_clearance, 0.0);
  EXPECT_EQ(plan.trajectory.start, request.t0);
  EXPECT_EQ(plan.trajectory.Position(plan.trajectory.end()), request.start.p);
}

// From within the hard radius: a plan that is certified only ever moves out, and is out when
// control wants it to be; where it cannot help moving in it is not certified.
TEST(Escape, OnlyMovesOutAndIsOutInTime) {
  const PlannerConfig config;
  const auto planner = MakePlanner("chase", config);
  int out = 0, on = 0;
  for (const double gap : {0.2, 0.33, 0.365})
    for (const double inwards : {-0.8, -0.4, 0.0, 0.02, 0.1})
      for (const double drift : {0.0, 0.3, -0.3}) {  // of both
        PlanRequest request = Hover();
        request.start.v = {0.0, inwards + drift, 0.0};
        const Vector3d at = request.start.p + Vector3d(0.0, gap + 0.3, 0.0);
        request.obstacles = {Cylinder(1, at, {0.0, drift, 0.0}, 0.3, 3.0)};
        const PlanResult plan = planner->Plan(request);
        if (plan.certified_clearance < 0.0) {
          EXPECT_TRUE(plan.verdict == Verdict::kBrake || plan.verdict == Verdict::kMitigate)
              << gap << " " << inwards;
          continue;
        }
        EXPECT_LE(inwards, 0.0) << gap << " " << drift;
        EXPECT_EQ(plan.verdict, Verdict::kEscape) << plan.reason;
        EXPECT_EQ(plan.certified_clearance, 0.0);
        EXPECT_NEAR(LeastDistance(request.obstacles[0], plan.trajectory), gap, 1e-6);
        for (const Proof& p : plan.proofs) EXPECT_LE(p.from, 0.25);
        ++out;
        request.stop = plan.trajectory;  // flown on
        request.t0 = plan.trajectory.start + 0.05;
        request.start = plan.trajectory.At(request.t0);
        const PlanResult next = RestPlan(config, request);
        if (next.reason != "on the stop of the plan before") continue;
        EXPECT_EQ(next.verdict, Verdict::kEscape) << gap << " " << inwards << " " << drift;
        ++on;
      }
  EXPECT_GE(out, 15);
  EXPECT_GT(on, 0);
}

/// As the autopilot leaves it that has begun to land; the slab reaches above the body.
TEST(Escape, LeadsUpFromTheGround) {
  const PlannerConfig config;
  world::Obstacle slab;
  slab.ground = true;
  slab.solid = world::Obstacle::Solid::kBox;
  slab.half = {8.5, 8.5, 0.3};
  slab.shape = (3.0 * slab.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  slab.center = world::Trajectory::Constant({2.0, 3.0, 0.17}, 0.0, 1.0);
  for (const double z : {0.12, 0.3, 0.5}) {
    PlanRequest request = Hover();
    request.start.p.z() = z;
    request.obstacles = {slab};
    const PlanResult plan = RestPlan(config, request);
    EXPECT_EQ(plan.verdict, Verdict::kEscape) << z << " " << plan.reason;
    EXPECT_GT(plan.trajectory.Position(plan.trajectory.end()).z(), 0.47 + config.hard_radius());
  }
}

}  // namespace
}  // namespace chase::planning
