// Coming down because it was asked for.

#include <gtest/gtest.h>

#include <cmath>

#include "test/unit/control_flight.h"

namespace chase::control {
namespace {

using Eigen::Vector3d;
using test::Body;
using test::Flight;
using test::LinePlan;
using test::PointPlan;

/// A hover that was planned to land from.
Plan LandingPlan(const Vector3d& p, double start = 0.0) {
  Plan plan = PointPlan(p, start);
  plan.to_land = true;
  return plan;
}

TEST(AskedToLand, ComesDownOnTheSpotAndStopsTheMotors) {
  for (const double mass : {0.96, 1.0, 1.04})
    for (const double wind : {0.0, 3.0}) {
      Flight flight({1, -1, 2});
      flight.body.mass_factor = mass;
      flight.body.wind = {wind, 0, 0};
      flight.controller.AddPlan(LandingPlan({1, -1, 2}));
      flight.Fly(10.0, Health::kUsable);
      flight.controller.SetLanding(true);
      flight.Fly(12.0, Health::kUsable);
      EXPECT_EQ(flight.controller.following(), Following::kLand);
      const Vector3d half_way = flight.body.p;
      flight.Fly(25.0, Health::kUsable);
      ASSERT_GT(flight.down_at, 0.0) << "mass " << mass << " wind " << wind;
      EXPECT_LT((half_way - Vector3d(1, -1, half_way.z())).norm(), 0.1);
      EXPECT_LE(flight.impact, 0.5) << "mass " << mass << " wind " << wind;
      EXPECT_GT(flight.off_at, flight.down_at) << "mass " << mass << " wind " << wind;
      EXPECT_LT(flight.off_at, flight.down_at + 1.0) << "mass " << mass << " wind " << wind;
    }
}

// Whoever leads it to level ground hangs: it stops short of that, and comes down there only when
// nobody leads it on.
TEST(AskedToLand, OnAStopItWaitsForWhoeverLeadsIt) {
  for (const bool led : {false, true}) {
    Flight flight({0, 0, 2});
    Plan plan = LinePlan({0, 0, 2}, 0.5);
    plan.stop = world::Trajectory::Constant({0.2, 0, 2}, 0.4, 1.0);
    plan.to_land = true;
    flight.controller.AddPlan(plan);
    flight.Fly(0.1, Health::kUsable);
    flight.controller.SetLanding(true);
    flight.Fly(2.2, Health::kUsable);
    EXPECT_EQ(flight.controller.following(), Following::kStop);
    Plan on = LinePlan({0.2, 0, 2}, 0.4, 2.3);
    on.to_land = true;
    if (led) flight.controller.AddPlan(on);
    flight.Fly(25.0, Health::kUsable);
    ASSERT_GT(flight.down_at, 0.0);
    EXPECT_NEAR(flight.body.p.x(), led ? 2.2 : 0.2, 0.3);
  }
}

TEST(AskedToLand, StopsBeforeItComesDown) {
  Flight flight({0, 0, 2});
  flight.body.v = {2, 0, 0};
  Plan plan = LinePlan({0, 0, 2}, 2.0);
  plan.stop = world::Trajectory::Constant({4, 0, 2}, 2.0, 2.0);
  plan.stop->coefficients.conservativeResize(3, 3);
  plan.stop->coefficients.row(1) = Eigen::RowVector3d(4.0, 0.0, 0.0);
  plan.stop->coefficients.row(2) = Eigen::RowVector3d(-2.0, 0.0, 0.0);
  flight.controller.AddPlan(plan);
  flight.Fly(1.0, Health::kUsable);
  flight.controller.SetLanding(true);
  flight.Fly(3.0, Health::kUsable);
  EXPECT_EQ(flight.controller.following(), Following::kStop);
  EXPECT_NEAR(flight.body.p.z(), 2.0, 0.1);
  flight.Fly(15.0, Health::kUsable);
  EXPECT_GT(flight.off_at, 0.0);
  EXPECT_NEAR(flight.body.p.x(), 6.0, 0.3) << "where it came to rest";
}

TEST(AskedToLand, GustsDelayItButNotForEver) {
  Flight flight({0, 0, 2});
  flight.controller.AddPlan(LandingPlan({0, 0, 2}));
  flight.Fly(1.0, Health::kUsable);
  flight.controller.SetLanding(true);
  int n = 0;
  for (double t = 1.0; t < 80.0; t += 0.02) {
    flight.body.v.x() = n++ % 2 ? 0.8 : -0.8;
    flight.Fly(t, Health::kUsable);
    if (t < 40.0) {
      ASSERT_NE(flight.controller.following(), Following::kLand) << t;
    }
  }
  EXPECT_GT(flight.off_at, 0.0);
}

// It was led about for all of the time that a way to the ground may take.
TEST(AskedToLand, BrakesBeforeItComesDownForWantOfTime) {
  Flight flight({0, 0, 3});
  Plan way = LinePlan({0, 0, 3}, 1.5);
  way.position.duration = 100.0;
  way.position.coefficients.row(1) *= 20.0;
  way.to_land = true;
  flight.controller.AddPlan(way);
  flight.Fly(1.0, Health::kUsable);
  flight.controller.SetLanding(true);
  flight.Fly(45.9, Health::kUsable);
  EXPECT_EQ(flight.controller.following(), Following::kPlan);
  EXPECT_NEAR(flight.body.v.x(), 1.5, 0.1);
  flight.Fly(46.1, Health::kUsable);
  EXPECT_EQ(flight.controller.following(), Following::kBrake);
  flight.Fly(48.1, Health::kUsable);
  EXPECT_EQ(flight.controller.following(), Following::kLand);
  EXPECT_LT(flight.body.v.head<2>().norm(), 0.4);
  const double x = flight.body.p.x();
  flight.Fly(60.0, Health::kUsable);
  EXPECT_GT(flight.off_at, 0.0);
  EXPECT_NEAR(flight.body.p.x(), x, 0.2);
}

TEST(AskedToLand, HoldsAgainWhenItIsAskedNoMore) {
  Flight flight({0, 0, 3});
  flight.controller.AddPlan(LandingPlan({0, 0, 3}));
  flight.Fly(1.0, Health::kUsable);
  flight.controller.SetLanding(true);
  flight.Fly(4.0, Health::kUsable);
  const Vector3d here = flight.body.p;
  EXPECT_LT(here.z(), 2.2);
  flight.controller.SetLanding(false);
  EXPECT_EQ(flight.controller.AddPlan(PointPlan(here, 4.0)), "");
  flight.Fly(8.0, Health::kUsable);
  EXPECT_EQ(flight.controller.following(), Following::kStop);
  EXPECT_NEAR(flight.body.p.z(), here.z(), 0.05);
  EXPECT_LT(flight.off_at, 0.0);
}

TEST(AskedToLand, GoesOnDownWithoutAPosition) {
  Flight flight({0, 0, 3});
  flight.controller.AddPlan(LandingPlan({0, 0, 3}));
  flight.Fly(1.0, Health::kUsable);
  flight.controller.SetLanding(true);
  flight.Fly(3.0, Health::kUsable);
  flight.Fly(3.5, Health::kLost);
  EXPECT_EQ(flight.controller.following(), Following::kLand);
  flight.Fly(15.0, Health::kLost);
  EXPECT_GT(flight.off_at, flight.down_at);
  EXPECT_LT(flight.impact, 0.5);
}

TEST(AskedToLand, MotorsRunAsLongAsItIsInTheAir) {
  for (const double gust : {-3.0, 3.0}) {
    Flight flight({0, 0, 40});
    flight.controller.AddPlan(PointPlan({0, 0, 40}));
    flight.Fly(20.0, Health::kUsable);
    flight.controller.SetLanding(true);
    for (double until = 20.5; until < 60.0; until += 0.5) {
      flight.body.wind.z() = static_cast<int>(until) % 4 < 2 ? gust : 0.0;
      flight.Fly(until, Health::kUsable);
    }
    EXPECT_LT(flight.off_at, 0.0) << "gust " << gust;
    EXPECT_LT(flight.body.p.z(), 32.0);
  }
}

TEST(AskedToLand, FliesToTheEndOfAPlanToLandFirst) {
  for (const bool stops : {false, true}) {
    Flight flight({0, 0, 2});
    Plan plan = LandingPlan({0, 0, 2});
    plan.position.duration = 5.0;
    plan.position.coefficients = Eigen::MatrixXd::Zero(4, 3);
    plan.position.coefficients.row(0) << 0.0, 0.0, 2.0;
    plan.position.coefficients.row(2) << 9.0, 0.0, 0.0;
    plan.position.coefficients.row(3) << -6.0, 0.0, 0.0;  // at rest at x = 3 m
    if (stops) plan.stop = world::Trajectory::Constant({1.056, 0, 2}, 2.0, 1.0);
    flight.controller.SetLanding(true);
    flight.controller.AddPlan(plan);
    flight.Fly(1.0, Health::kUsable);
    EXPECT_EQ(flight.controller.following(), Following::kPlan) << "though it was at rest at first";
    flight.Fly(20.0, Health::kUsable);
    EXPECT_GT(flight.off_at, 0.0);
    EXPECT_NEAR(flight.body.p.x(), stops ? 1.056 : 3.0, 0.35);
  }
}

TEST(AskedToLand, WithoutAPlanToLandItWaitsThenComesDownWhereItIs) {
  Flight flight({0, 0, 2});
  flight.controller.AddPlan(PointPlan({0, 0, 2}));
  flight.Fly(3.0, Health::kUsable);
  flight.controller.SetLanding(true);
  flight.Fly(4.9, Health::kUsable);
  EXPECT_NE(flight.controller.following(), Following::kLand);
  EXPECT_EQ(flight.controller.AddPlan(PointPlan({0, 0, 2}, 4.9)), "") << "made for something else";
  flight.Fly(5.1, Health::kUsable);
  EXPECT_EQ(flight.controller.following(), Following::kLand);
}

TEST(AskedToLand, OnTheGroundNothingHappens) {
  Controller controller{ControlConfig{}};
  controller.SetLanding(true);
  EXPECT_FALSE(controller.Update(0.0, Body().Measured(), Health::kUsable).has_value());
}

}  // namespace
}  // namespace chase::control
