#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "services/planning/limits.h"
#include "services/planning/pilot.h"
#include "services/planning/problem.h"
#include "services/planning/stopping.h"

namespace chase::planning {
namespace {

using Eigen::Vector3d;

world::Obstacle Slab(const Vector3d& center, const Eigen::Vector2d& slope) {
  world::Obstacle o;
  o.id = 1;
  o.ground = true;
  o.center = world::Trajectory::Constant(center, 0.0, 3.0);
  o.solid = world::Obstacle::Solid::kBox;
  o.half = {12.0, 12.0, 0.3};
  o.axes =
      Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d(-slope.x(), -slope.y(), 1.0));
  const Eigen::Matrix3d R = o.axes.toRotationMatrix();
  o.shape = R * (3.0 * o.half.cwiseAbs2()).cwiseInverse().asDiagonal() * R.transpose();
  return o;
}

/// A target that drives uphill along x, the drone 3 m behind it at the same height above ground.
PlanRequest Uphill(double slope) {
  PlanRequest r;
  r.horizon = 2.5;
  r.start.p = {-3.0, 0.0, 1.2 - 3.0 * slope};
  r.start.v = {1.5, 0.0, 1.5 * slope};
  r.target = {0.0, 2.5, Eigen::MatrixXd::Zero(2, 3)};
  r.target.coefficients << 0.0, 0.0, 0.5, 3.75, 0.0, 3.75 * slope;
  r.obstacles = {Slab({0.0, 0.0, 0.0}, {slope, 0.0})};
  return r;
}

TEST(Ground, PlansKeepTheirHeightAboveItUphillAndDownhill) {
  const PlannerConfig config;
  const auto planner = MakePlanner("chase", config);
  for (const double slope : {-0.25, -0.1, 0.1, 0.25}) {
    PlanRequest request = Uphill(slope);
    for (int i = 0; i < 20; ++i) {
      request.target.start = request.t0;
      request.target.coefficients.row(0) =
          Vector3d(1.5 * request.t0, 0.0, 0.5 + 1.5 * slope * request.t0).transpose();
      const PlanResult plan = planner->Plan(request);
      EXPECT_LT(plan.verdict, Verdict::kSafeOnly) << slope << " " << i << " " << plan.reason;
      for (double t = request.t0; t <= plan.trajectory.end(); t += 0.05) {
        const Vector3d p = plan.trajectory.Position(t);
        const double above = p.z() - slope * p.x();
        EXPECT_GT(above, config.z_min - 1e-6) << slope << " " << i;
        EXPECT_LT(above, config.z_max + 1e-6) << slope << " " << i;
      }
      request.t0 += 0.2;
      request.start = plan.trajectory.At(request.t0);
      request.running = plan.trajectory;
      request.obstacles[0].center.start = request.t0;
    }
  }
}

TEST(Ground, LimitsOfHeightAreThoseOfSamples) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> within(-1.0, 1.0);
  int kept = 0, broken = 0;
  for (int i = 0; i < 20000; ++i) {
    Problem problem;
    Limits& l = problem.limits;
    l.height = true;
    l.z_min = 0.6;
    l.z_max = 3.5;
    l.ground = {0.4 * within(random), 0.4 * within(random), 5.0 * within(random)};
    Curve plan(6, 3);
    for (double& x : plan.reshaped()) x = 2.0 * within(random);
    plan(0, 2) += l.ground.z0 + 2.0;
    problem.target = Curve::Zero(2, 3);
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int k = 0; k <= 400; ++k) {
      const Vector3d p = Evaluate(plan, k / 400.0);
      const double z = p.z() - l.ground.slope_x * p.x() - l.ground.slope_y * p.y() - l.ground.z0;
      low = std::min(low, z);
      high = std::max(high, z);
    }
    const bool keeps = KeepsLimits(plan, problem);
    if (low < l.z_min || high > l.z_max) {
      EXPECT_FALSE(keeps) << i;
    }
    if (low > l.z_min + 1e-3 && high < l.z_max - 1e-3) {
      EXPECT_TRUE(keeps) << i;
    }
    kept += keeps;
    broken += !keeps;
  }
  EXPECT_GT(kept, 1000);
  EXPECT_GT(broken, 1000);
}

// Small slabs and large ones: no plane has less of a squared distance to their corners, by area.
TEST(Ground, ItsPlaneIsTheNearestToWhatIsListed) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> within(-1.0, 1.0);
  EXPECT_EQ(GroundOf({}).z0, 0.0);
  EXPECT_EQ(GroundOf({}).Rise({1.0, 1.0, 2.0}), 2.0);
  for (int i = 0; i < 100; ++i) {
    std::vector<world::Obstacle> slabs;
    const double size = std::pow(10.0, within(random) - 0.5);
    for (int k = 0; k < 5; ++k) {
      slabs.push_back(
          Slab(size * Vector3d(3.0 * within(random), 3.0 * within(random), within(random)),
               0.3 * Eigen::Vector2d(within(random), within(random))));
      slabs.back().half = {size * (1.1 + within(random)), size * (1.1 + within(random)), 0.3};
      slabs.back().ground = k < 4;  // the last is none
    }
    const auto squares = [&](const Ground& g) {
      double sum = 0.0;
      for (int k = 0; k < 4; ++k)
        for (const double x : {-1.0, 1.0})
          for (const double y : {-1.0, 1.0}) {
            const world::Obstacle& o = slabs[static_cast<size_t>(k)];
            const Vector3d corner =
                o.center.Position(0.0) + o.axes * Vector3d(x * o.half.x(), y * o.half.y(), 0.0);
            sum += o.half.x() * o.half.y() * g.Above(corner) * g.Above(corner);
          }
      return sum;
    };
    const Ground ground = GroundOf(slabs);
    const double least = squares(ground);
    for (int k = 0; k < 20; ++k) {
      Ground other = ground;
      other.slope_x += 0.01 * within(random);
      other.slope_y += 0.01 * within(random);
      other.z0 += 0.01 * size * within(random);
      EXPECT_GE(squares(other), least) << i;
    }
  }
}

// A step in the ground that the plane through it does not show is kept off like an obstacle.
TEST(Ground, WhatRisesAboveItsPlaneIsKeptOff) {
  const auto planner = MakePlanner("chase", PlannerConfig());
  PlanRequest request = Uphill(0.0);
  request.start.p.z() = 0.9;
  request.obstacles.push_back(Slab({1.5, 0.0, 0.5}, {0.0, 0.0}));
  request.obstacles.back().id = 2;
  request.obstacles.back().half.head<2>().setConstant(1.0);
  const PlanResult plan = planner->Plan(request);
  ASSERT_GE(plan.certified_clearance, 0.0) << plan.reason;
  const double hard = PlannerConfig().hard_radius();
  for (double t = 0.0; t <= plan.trajectory.end(); t += 0.02) {
    const Vector3d d = plan.trajectory.Position(t) - Vector3d(1.5, 0.0, 0.5);
    EXPECT_GE((d.cwiseAbs() - Vector3d(1.0, 1.0, 0.3)).cwiseMax(0.0).norm(), hard - 1e-6) << t;
  }
}

TEST(Ground, ItHidesNothing) {
  PlanRequest request = Uphill(0.0);
  request.target.coefficients(0, 2) = request.target.coefficients(1, 2) = 0.0;
  request.target.coefficients(0, 2) = 0.25;  // within the slab
  const PlanResult plan = MakePlanner("chase", PlannerConfig())->Plan(request);
  EXPECT_EQ(plan.verdict, Verdict::kChase) << plan.reason;
}

// Steeper than the camera sees, plans get no steeper.
TEST(Elevation, AStartBeyondItOnlyComesBack) {
  PlannerConfig config;
  config.min_distance = 0.3;
  const auto planner = MakePlanner("chase", config);
  PlanRequest request;
  request.horizon = 2.5;
  request.start.p = {-1.2, 0.0, 1.7};
  request.target = world::Trajectory::Constant({0.0, 0.0, 0.7}, 0.0, 2.5);
  double steepest = 1.0 / 1.2;
  for (int i = 0; i < 10; ++i) {
    const PlanResult plan = planner->Plan(request);
    ASSERT_LE(plan.verdict, Verdict::kSafeOnly) << plan.reason;
    for (double t = request.t0; t <= plan.trajectory.end(); t += 0.05) {
      const Vector3d d = plan.trajectory.Position(t) - Vector3d(0.0, 0.0, 0.7);
      EXPECT_LT(std::abs(d.z()) / d.head<2>().norm(), std::max(steepest, 0.54) + 1e-4);
    }
    request.t0 += 0.3;
    request.start = plan.trajectory.At(request.t0);
    request.running = plan.trajectory;
    request.target.start = request.t0;
    const Vector3d d = request.start.p - Vector3d(0.0, 0.0, 0.7);
    steepest = std::abs(d.z()) / d.head<2>().norm();
  }
  EXPECT_LT(steepest, std::tan(config.max_elevation_deg * M_PI / 180.0));
}

// Among movers that leave no way, the way of least harm keeps the limits wherever one of the
// brakings that it weighs does.
TEST(Rest, TheLeastHarmCanBeFlown) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> within(-1.0, 1.0);
  const PlannerConfig config;
  int uncertified = 0;
  for (int i = 0; i < 80; ++i) {
    PlanRequest request;
    request.start.p = {0.0, 0.0, 1.5};
    request.start.v = {2.8 * within(random), 2.8 * within(random), 0.0};
    request.start.a = {4.0 * within(random), 4.0 * within(random), 0.0};
    request.target = world::Trajectory::Constant({5.0, 0.0, 0.7}, 0.0, 2.5);
    const auto braking = Brake(config, request);
    if (!braking || (braking->trajectory.duration != 0.6 && braking->trajectory.duration != 1.0 &&
                     braking->trajectory.duration != 1.7))
      continue;
    for (int k = 0; k < 8; ++k) {
      world::Obstacle o;
      o.id = k + 1;
      o.moving = true;
      const double angle = 0.25 * M_PI * k;
      const Vector3d at(1.1 * std::cos(angle), 1.1 * std::sin(angle), 1.5);
      o.center = {0.0, 3.0, Eigen::MatrixXd::Zero(2, 3)};
      o.center.coefficients.row(0) = at.transpose();
      o.center.coefficients.row(1) = -1.5 * at.transpose();
      o.shape = Vector3d(11.0, 11.0, 0.02).asDiagonal();
      o.velocity_covariance.diagonal().setConstant(0.1);
      request.obstacles.push_back(o);
    }
    const PlanResult plan = RestPlan(config, request);
    uncertified += plan.certified_clearance < 0.0;
    for (double t = 0.0; t <= plan.trajectory.end(); t += 0.05) {
      EXPECT_LE(plan.trajectory.Velocity(t).norm(),
                std::max(config.max_speed, request.start.v.norm()) + 1e-3);
      EXPECT_LE(plan.trajectory.Derivative(2, t).norm(), config.max_acceleration + 1e-3);
    }
  }
  EXPECT_GT(uncertified, 10);
}

// From within the hard radius of the ground it rises, out of it by when control wants it to be.
TEST(Rest, OutOfTheGroundInTime) {
  const PlannerConfig config;
  for (const double slope : {0.0, 0.15}) {
    PlanRequest request = Uphill(slope);
    request.start.v.setZero();
    request.start.p = {0.0, 0.0, 0.5};
    const PlanResult plan = RestPlan(config, request);
    EXPECT_EQ(plan.verdict, Verdict::kEscape) << plan.reason;
    EXPECT_GE(plan.certified_clearance, 0.0);
    ASSERT_FALSE(plan.proofs.empty());
    for (const Proof& p : plan.proofs) EXPECT_TRUE(p.from > 0.0 && p.from <= 0.6);
    double before = 0.0;
    for (double tau = 0.0; tau <= 1.0; tau += 0.02) {
      const Vector3d p =
          plan.trajectory.Position(plan.trajectory.start + tau * plan.trajectory.duration);
      const double above = (p.z() - slope * p.x()) / std::hypot(1.0, slope) - 0.3;
      EXPECT_GE(above, tau < 0.6 ? before - 1e-9 : config.hard_radius() - 1e-6) << tau;
      before = above;
    }
  }
}

// By the line to its centre a wide slab is far away until the body is in it.
TEST(Rest, SinkingIntoAWideSlabItDoesNotFleeUp) {
  PlanRequest request;
  request.obstacles = {Slab({8.0, -8.0, 0.24}, {-0.003, -0.015}),
                       Slab({8.0, 8.0, 0.18}, {-0.003, 0.01})};
  request.obstacles[1].id = 2;
  request.start.p = {12.1, 1.06, 0.64};
  request.start.v = {-0.05, 0.43, -0.44};
  const PlanResult plan = RestPlan(PlannerConfig(), request);
  for (double t = 0.0; t <= plan.trajectory.end(); t += 0.05)
    EXPECT_LT(plan.trajectory.Velocity(t).z(), 0.5) << plan.reason;
}

// What is too low to be an obstacle lies within the ground's slabs: a body that has sunk into them
// comes out gently.
TEST(Rest, OutOfTheGroundItClimbsWithinTheLimits) {
  const PlannerConfig config;
  PlanRequest request;
  request.obstacles = {Slab({0.0, 0.0, 0.12}, {0.0, 0.0})};
  for (const double sinking : {0.0, 0.2, 0.44, 0.8}) {
    request.start = world::State();
    request.start.p.z() = 0.64;
    request.start.v = {0.3, 0.0, -sinking};
    double fastest = 0.0;
    for (int i = 0; i < 30; ++i) {
      request.t0 = 0.1 * i;
      const PlanResult plan = RestPlan(config, request);
      for (double t = request.t0; t < request.t0 + 0.1; t += 0.02) {
        const world::State s = plan.trajectory.At(std::min(t, plan.trajectory.end()));
        EXPECT_LT(s.a.norm(), config.max_acceleration + 1e-6) << sinking << " " << t;
        fastest = std::max(fastest, s.v.norm());
      }
      request.start = plan.trajectory.At(std::min(request.t0 + 0.1, plan.trajectory.end()));
    }
    EXPECT_LT(fastest, 2.0) << sinking;
    EXPECT_GT(request.start.p.z(), 0.42 + config.hard_radius()) << sinking;
  }
}

TEST(Pilot, TheTubeHoldsTheDeviationOfTheEstimate) {
  Pilot pilot{PlanningConfig()};
  pilot.SetTrackingBound(0.0, 0.1);
  BodyEstimate body;
  body.position_covariance.diagonal().setConstant(0.04 * 0.04);
  pilot.Update(0.0, body);
  EXPECT_NEAR(pilot.hard_radius(), 0.25 + 0.1 + 2.0 * 0.04, 1e-9);
  body.position_covariance(0, 0) = std::nan("");
  pilot.Update(0.1, body);
  EXPECT_NEAR(pilot.hard_radius(), 0.25 + 0.3, 1e-9);
}

TEST(Pilot, TheTubeIsTheWidestWhereControlFellSilent) {
  Pilot pilot{PlanningConfig()};
  const auto tube = [&](double t) {
    pilot.Update(t, {});
    return pilot.hard_radius() - PlannerConfig{}.drone_radius;
  };
  EXPECT_NEAR(tube(9.0), 0.12, 1e-9);  // not heard yet
  pilot.SetTrackingBound(10.0, 0.15);
  EXPECT_NEAR(tube(10.25), 0.15, 1e-9);
  EXPECT_NEAR(tube(10.35), 0.3, 1e-9);
  pilot.SetTrackingBound(10.6, 0.15);
  EXPECT_NEAR(tube(10.36), 0.3, 1e-9);  // of another clock
  pilot.SetTrackingBound(10.36, 0.15);
  EXPECT_NEAR(tube(10.4), 0.15, 1e-9);
}

/// Along x, its face at y = 1.9 m.
world::Obstacle Wall() {
  world::Obstacle wall = Slab({0.0, 2.0, 1.5}, {0.0, 0.0});
  wall.ground = false;
  wall.half = {12.0, 0.1, 3.0};
  wall.axes.setIdentity();
  wall.shape = (3.0 * wall.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  return wall;
}

// Past a wall in a frame that drifts towards it: the body strays from plan and stop, and the wall
// comes nearer, by as much as either may; the clearance that is certified is left. One that nobody
// has seen is kept off by the stop, and until it begins.
TEST(Pilot, AFrameThatDriftsKeepsOffStaticObstacles) {
  PlanningConfig config;
  config.takeoff_time = 0.1;
  const auto room = [&](double bound, double sigma, bool seen) {
    Pilot pilot(config);
    pilot.SetFlying(true);
    pilot.SetTrackingBound(0.0, bound);
    const world::Obstacle wall = Wall();
    pilot.SetObstacles(0.0, seen ? std::vector{wall} : std::vector<world::Obstacle>());
    pilot.SetUnseen(0.0, seen ? std::vector<world::Obstacle>() : std::vector{wall});
    Forecast forecast;
    forecast.has_target = true;
    forecast.target = world::Trajectory::Constant({2.5, 1.5, 0.7}, 0.0, 2.5);
    pilot.SetForecast(forecast);
    BodyEstimate body{{0.0, 0.6, 1.2}, {0.0, seen ? 0.0 : 1.0, 0.0}, 0.0};
    body.velocity_covariance.diagonal().setConstant(sigma * sigma);
    double least = -HUGE_VAL;
    for (double t = 0.0; std::isinf(least) && t < 1.0; t += 0.05)
      if (const auto plan = pilot.Update(t, body)) {
        const auto left = [&](const world::Trajectory& way, double until) {
          double most = 0.0;  // of the wall's way and the body's
          for (double at = way.start; at <= until; at += 0.02 * way.duration) {
            const double drift = config.planner.sigmas * sigma * (at - plan->trajectory.start);
            most = std::max(most, way.Position(at).y() + drift + bound);
          }
          return 1.9 - most - config.planner.drone_radius;
        };
        EXPECT_GE(plan->certified_clearance, 0.0);
        least = seen ? left(plan->trajectory, plan->trajectory.end()) - plan->certified_clearance
                     : left(plan->trajectory, plan->stop ? plan->stop->start : 0.0);
        if (plan->stop) least = std::min(least, left(*plan->stop, plan->stop->end()));
        if (!seen && !plan->stop) {
          EXPECT_GE(plan->verdict, Verdict::kBrake) << bound << " " << sigma;
        }
      }
    return least;
  };
  for (const double sigmas : {config.planner.sigmas, 0.4}) {
    config.planner.sigmas = sigmas;
    for (const double bound : {0.0, 0.06, 0.115, 0.2})
      for (const double sigma : {0.0, 0.003, 0.01, 0.02, 0.05, 0.1, 0.2})
        for (const bool seen : {true, false})
          EXPECT_GE(room(bound, sigma, seen), -1e-6)
              << sigmas << " " << bound << " " << sigma << " " << seen;
  }
}

// A way back takes longer than the tube is spared for.
TEST(Pilot, OnTheWayBackTheTubeHoldsNoDrift) {
  const PlanningConfig config;
  const double sigma = 0.01;
  int certified = 0;
  for (double y = 1.0; y < 1.5; y += 0.05) {
    Pilot pilot(config);
    pilot.SetFlying(true);
    pilot.SetTrackingBound(0.0, 0.0);
    pilot.SetObstacles(0.0, {Wall()});
    pilot.SetTask(Task::kReturn, Vector3d(7.9, y, 0.0));
    BodyEstimate body{{0.0, y, config.takeoff_height}, Vector3d::Zero(), 0.0};
    body.velocity_covariance.diagonal().setConstant(sigma * sigma);
    const auto plan = pilot.Update(0.0, body);
    ASSERT_TRUE(plan);
    if (plan->reason != "returning") continue;
    ++certified;
    const world::Trajectory& way = plan->trajectory;
    for (double t = way.start; t <= way.end(); t += 0.02 * way.duration)
      EXPECT_GE(1.9 - way.Position(t).y() - 2.0 * sigma * t - config.planner.drone_radius,
                plan->certified_clearance - 1e-6)
          << y << " " << t;
  }
  EXPECT_GT(certified, 3);
}

}  // namespace
}  // namespace chase::planning
