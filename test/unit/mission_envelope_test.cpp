#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/world/column.h"
#include "test/unit/mission_bench.h"

namespace chase::mission {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Geofence;

/// Angles at p from corner to corner add up to a turn when p is inside: another rule than the
/// fence's own.
bool Encloses(const std::vector<Vector2d>& polygon, const Vector2d& p) {
  double turn = 0.0;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d a = polygon[i] - p, b = polygon[(i + 1) % polygon.size()] - p;
    turn += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
  }
  return std::abs(turn) > M_PI;
}

Geofence Box(double half, double ceiling = 5.0) {
  Geofence fence;
  fence.polygon = {{-half, -half}, {half, -half}, {half, half}, {-half, half}};
  fence.ceiling = ceiling;
  return fence;
}

TEST(Geofence, AgreesWithTheWindingNumberOnRandomStars) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> radius(1.0, 10.0), place(-11.0, 11.0), height(-2.0, 7.0);
    Geofence fence = Box(1.0);
    fence.polygon.clear();
    const int corners = 3 + static_cast<int>(random() % 8);
    for (int i = 0; i < corners; ++i) {
      const double angle = 2.0 * M_PI * i / corners;
      fence.polygon.emplace_back(radius(random) * Vector2d(std::cos(angle), std::sin(angle)));
    }
    ASSERT_EQ(fence.Problem(), "") << "seed " << seed;
    for (int i = 0; i < 200; ++i) {
      const Vector3d p(place(random), place(random), height(random));
      const bool inside =
          Encloses(fence.polygon, p.head<2>()) && p.z() >= fence.floor && p.z() <= fence.ceiling;
      ASSERT_EQ(fence.Breach(p).empty(), inside) << "seed " << seed << ", " << p.transpose();
    }
  }
}

TEST(Geofence, AMarginIsTheDistanceToItsEdgesAndHeights) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-2.5, 2.5);
  for (int i = 0; i < 500; ++i) {
    const Vector3d p(u(random), u(random), 2.0 + u(random));
    const double room =
        std::min({2.0 - std::abs(p.x()), 2.0 - std::abs(p.y()), 5.0 - p.z(), p.z() + 1.0});
    EXPECT_EQ(Box(2.0).Breach(p, 0.3).empty(), room >= 0.3) << p.transpose();
  }
}

TEST(Geofence, IsCheckedAndNotFiniteIsOutside) {
  Geofence fence = Box(2.0);
  EXPECT_EQ(fence.Problem(), "");
  EXPECT_NE(fence.Breach({NAN, 0.0, 0.0}), "");
  fence.ceiling = -0.5;
  EXPECT_NE(fence.Problem(), "");
  fence = Box(2.0);
  fence.polygon.resize(2);
  EXPECT_NE(fence.Problem(), "");
  for (Vector2d& corner : (fence = Box(2.0)).polygon) corner.x() += 5.0;
  EXPECT_NE(fence.Problem(), "") << "it would take off outside";
  EXPECT_EQ(Geofence().Breach({1e6, 0.0, 0.0}), "") << "no fence";
}

TEST(Geofence, RefusesWaysThatLeadOutOrTooNear) {
  const Geofence fence = Box(2.0);
  const double margin = 0.12;
  const auto refusal = [&](const Vector3d& p, double from, double to) {
    return fence.Refusal(p, {{from, 0.0, 1.0}, {0.5 * (from + to), 0.0, 1.0}, {to, 0.0, 1.0}},
                         margin);
  };
  EXPECT_EQ(refusal({1.0, 0.0, 1.0}, 1.0, 1.85), "");
  EXPECT_EQ(refusal({1.0, 0.0, 1.0}, 1.0, 1.95), "it leads too near to the geofence");
  EXPECT_EQ(refusal({1.0, 0.0, 1.0}, 1.0, 2.05), "it leads outside the geofence");
  EXPECT_EQ(refusal({1.95, 0.0, 1.0}, 1.95, 1.90), "") << "too near, nearer home";
  EXPECT_EQ(refusal({1.95, 0.0, 1.0}, 1.95, 1.97), "it leads no way back into the geofence");
  EXPECT_EQ(refusal({1.95, 0.0, 1.0}, 2.05, 1.90), "it leads outside the geofence");
  EXPECT_EQ(refusal({2.5, 0.0, 1.0}, 2.5, 2.3), "") << "outside, nearer home";
  EXPECT_EQ(refusal({2.5, 0.0, 1.0}, 2.5, 2.6), "it leads no way back into the geofence");
  // The plan rests nearer to the fence than the body, which is off it by less than the tube.
  EXPECT_EQ(refusal({1.87, 0.0, 1.0}, 1.89, 1.0), "");
  EXPECT_EQ(refusal({1.87, 0.0, 1.0}, 1.89, 1.9), "it leads no way back into the geofence");
}

// Around the inner corner of an L the way home leads away from it first.
TEST(Geofence, WhoIsTooNearIsLedToMoreRoomAlsoAwayFromHome) {
  Geofence fence;
  fence.polygon = {{-2, -2}, {2, -2}, {2, 10}, {8, 10}, {8, -2}, {12, -2}, {12, 14}, {-2, 14}};
  const Vector3d near(8.1, 8.0, 1.0);
  EXPECT_EQ(fence.Refusal(near, {near, {8.1, 12.0, 1.0}}, 0.12), "");
  EXPECT_EQ(fence.Refusal(near, {near, {8.05, 7.0, 1.0}}, 0.12),
            "it leads no way back into the geofence")
      << "nearer home, and to the fence";
  EXPECT_EQ(fence.Refusal(near, {near, {7.9, 8.0, 1.0}, {0.0, 8.0, 1.0}}, 0.12),
            "it leads outside the geofence");
  const Vector3d outside(7.9, 8.0, 1.0), below(1.0, 1.0, -1.5);
  EXPECT_EQ(fence.Refusal(outside, {outside, {8.5, 8.0, 1.0}}, 0.12), "");
  EXPECT_EQ(fence.Refusal(outside, {outside, {5.0, 8.0, 1.0}}, 0.12),
            "it leads no way back into the geofence");
  EXPECT_EQ(fence.Refusal(below, {below, {1.0, 1.0, 0.0}}, 0.12), "");
  EXPECT_EQ(fence.Refusal(below, {below, {0.0, 0.0, -1.6}}, 0.12),
            "it leads no way back into the geofence");
}

TEST(Envelope, AWayOutOfTheFenceIsHeldInsideWhateverTheState) {
  MissionConfig config;
  config.geofence = Box(10.0);
  for (const Event command : {Event::kChase, Event::kSearch}) {
    Bench bench(config);
    bench.tracked = command == Event::kChase;
    bench.Fly();
    ASSERT_TRUE(bench.Command(command).accepted);
    bench.mission.inputs().way = {{5.0, 0.0, 1.0}, {9.9, 0.0, 1.0}};
    bench.Run(0.5);
    ASSERT_NE(bench.mission.state(), State::kHold);
    bench.mission.inputs().way.emplace_back(10.1, 0.0, 1.0);
    bench.Run(0.2);
    EXPECT_EQ(bench.mission.state(), State::kHold);
    EXPECT_NE(bench.mission.reason().find("geofence"), std::string::npos);
    EXPECT_TRUE(bench.Command(command).accepted) << "the way may have changed";
    bench.Run(0.2);
    EXPECT_EQ(bench.mission.state(), State::kHold);
  }
}

TEST(Envelope, AWayOfAFlightBeforeIsNotJudgedByTheFenceOfThisOne) {
  MissionConfig config;
  config.geofence = Box(10.0);
  Bench bench(config);
  bench.mission.inputs().on_ground = true;
  bench.Run(0.2);
  ASSERT_TRUE(bench.Command(Event::kTakeoff).accepted);
  bench.mission.inputs().way = {{0.0, 0.0, 2.0}};
  bench.mission.inputs().handed_over = true;
  bench.Run(3.0);
  ASSERT_EQ(bench.mission.state(), State::kReady) << "called off";
  bench.mission.inputs().handed_over = false;
  bench.pose.p.x() = 20.0;
  bench.Run(0.2);
  ASSERT_TRUE(bench.Command(Event::kTakeoff).accepted);
  bench.Run(0.5);
  EXPECT_EQ(bench.mission.state(), State::kTakeoff) << bench.mission.reason();
}

TEST(Envelope, WhoIsOutsideReturns) {
  MissionConfig config;
  config.geofence = Box(10.0);
  for (const Vector3d& outside :
       {Vector3d(10.1, 0.0, 1.0), Vector3d(0.0, -11.0, 1.0), Vector3d(3.0, 0.0, 5.1)}) {
    Bench bench(config);
    bench.Fly();
    bench.pose.p = outside;
    bench.Run(0.2);
    EXPECT_EQ(bench.mission.state(), State::kReturn) << outside.transpose();
    EXPECT_NE(bench.mission.reason().find("geofence breached"), std::string::npos);
    EXPECT_TRUE(bench.Command(Event::kLand).accepted) << "an operator may land all the same";
  }
}

TEST(Envelope, OutsideTheFenceNothingLeadsAbout) {
  MissionConfig config;
  config.geofence = Box(10.0);
  Bench bench(config);
  bench.Fly();
  bench.pose.p.x() = 10.1;
  bench.Run(0.2);
  ASSERT_EQ(bench.mission.state(), State::kReturn);
  for (const Event command : {Event::kChase, Event::kSearch, Event::kHold}) {
    const world::CommandAnswer answer = bench.Command(command);
    EXPECT_FALSE(answer.accepted) << Name(command);
    EXPECT_EQ(answer.reason, "it is outside the geofence: it returns, lands or stops");
    EXPECT_EQ(bench.mission.state(), State::kReturn);
  }
  EXPECT_TRUE(bench.Command(Event::kReturn).accepted);
  bench.pose.p.x() = 9.9;
  bench.Run(0.1);
  EXPECT_TRUE(bench.Command(Event::kHold).accepted) << "inside again";
  ++bench.pose.epoch;
  bench.Run(0.1);
  const world::CommandAnswer answer = bench.Command(Event::kChase);
  EXPECT_FALSE(answer.accepted);
  EXPECT_EQ(answer.reason, "the take-off place is not known, nor the geofence");
}

TEST(Envelope, AStopHoldsWhereverItIsAndWhateverTheBatteryHas) {
  MissionConfig config;
  config.geofence = Box(10.0);
  for (const double charge : {0.8, 0.2, 0.05}) {
    Bench bench(config);
    bench.Fly();
    bench.mission.inputs().battery = charge;
    bench.pose.p.x() = 10.1;
    bench.Run(0.2);
    ASSERT_EQ(bench.mission.state(), charge < 0.1 ? State::kLand : State::kReturn);
    const world::CommandAnswer answer = bench.Command(Event::kStop);
    EXPECT_TRUE(answer.accepted) << answer.reason;
    bench.Run(5.0);
    EXPECT_EQ(bench.mission.state(), State::kHold) << "nobody undoes it";
    ASSERT_TRUE(bench.Command(Event::kLand).accepted);
    EXPECT_FALSE(bench.Command(Event::kHold).accepted) << "the envelope leads again";
  }
}

TEST(Envelope, WhatIsExceededAfterAStopCountsAndOnceMore) {
  MissionConfig config;
  config.geofence = Box(10.0);
  Bench bench(config);
  bench.Fly();
  bench.pose.p.x() = 10.1;
  bench.Run(0.2);
  ASSERT_TRUE(bench.Command(Event::kStop).accepted);
  bench.pose.p.x() = 9.9;
  bench.Run(0.2);
  ASSERT_EQ(bench.mission.state(), State::kHold);
  bench.pose.p.x() = 10.1;
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.state(), State::kReturn) << "outside for a second time";
  ASSERT_TRUE(bench.Command(Event::kStop).accepted);
  bench.mission.inputs().battery = 0.2;
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.state(), State::kReturn);
  ASSERT_TRUE(bench.Command(Event::kStop).accepted);
  bench.mission.inputs().battery = 0.05;
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.state(), State::kLand);
}

TEST(Envelope, InAnotherFrameTheFenceIsNotKnownAndNothingLeadsAbout) {
  MissionConfig config;
  config.geofence = Box(10.0);
  Bench bench(config);
  bench.Fly();
  ASSERT_TRUE(bench.Command(Event::kChase).accepted);
  bench.Run(0.3);
  ASSERT_EQ(bench.mission.state(), State::kChase);
  ++bench.pose.epoch;
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.state(), State::kHold);
}

TEST(Envelope, ABatteryThatRunsDownLeadsHomeThenDown) {
  for (const Event task : {Event::kChase, Event::kHold, Event::kSearch}) {
    Bench bench;
    bench.tracked = task == Event::kChase;
    bench.Fly({5.0, 0.0, 1.0});
    ASSERT_TRUE(bench.Command(task).accepted);
    State last = bench.mission.state();
    for (int percent = 100; percent >= 0; --percent) {
      bench.mission.inputs().battery = 0.01 * percent;
      bench.Run(0.1);
      const State state = bench.mission.state();
      ASSERT_EQ(state, percent <= 10   ? State::kLand
                       : percent <= 25 ? State::kReturn
                                       : last)
          << percent << " %";
    }
    EXPECT_EQ(bench.mission.reason(), "battery critical: landing here");
  }
}

TEST(Envelope, ALowBatteryRefusesWhatLeadsAway) {
  Bench bench;
  bench.Fly({5.0, 0.0, 1.0});
  bench.mission.inputs().battery = 0.2;
  bench.Run(0.2);
  ASSERT_EQ(bench.mission.state(), State::kReturn);
  for (const Event command : {Event::kChase, Event::kHold, Event::kSearch}) {
    const world::CommandAnswer answer = bench.Command(command);
    EXPECT_FALSE(answer.accepted);
    EXPECT_NE(answer.reason.find("battery is low"), std::string::npos) << answer.reason;
  }
  EXPECT_TRUE(bench.Command(Event::kReturn).accepted);
  bench.mission.inputs().battery = 0.05;
  bench.Run(0.2);
  ASSERT_EQ(bench.mission.state(), State::kLand);
  EXPECT_FALSE(bench.Command(Event::kHold).accepted);
  EXPECT_TRUE(bench.Command(Event::kLand).accepted);
}

TEST(Envelope, IsNotReadyWithABatteryThatNobodyTellsOf) {
  for (const bool never : {true, false}) {
    Bench bench;
    if (never) bench.mission.inputs().battery.reset();
    bench.Run(0.2);
    bench.hears_battery = false;
    bench.Run(10.0);
    EXPECT_EQ(bench.mission.state(), State::kIdle);
    EXPECT_NE(bench.Command(Event::kTakeoff).reason.find("the battery's charge is not known"),
              std::string::npos);
  }
  MissionConfig config;
  config.battery_low = config.battery_critical = 0.0;  // a vehicle that cannot tell
  Bench bench(config);
  bench.mission.inputs().battery.reset();
  bench.Run(0.2);
  EXPECT_TRUE(bench.Command(Event::kTakeoff).accepted);
}

TEST(Envelope, IsNotReadyWithALowBatteryOrABlockedWayUp) {
  Bench bench;
  bench.mission.inputs().battery = 0.2;
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.state(), State::kIdle);
  EXPECT_NE(bench.Command(Event::kTakeoff).reason.find("the battery is low: 20 %"),
            std::string::npos);
  bench.mission.inputs().battery = 0.8;
  bench.mission.inputs().blocked = true;
  bench.Run(0.2);
  EXPECT_NE(bench.Command(Event::kTakeoff).reason.find("the way up is not free"),
            std::string::npos);
  bench.mission.inputs().blocked = false;
  bench.Run(0.2);
  EXPECT_TRUE(bench.Command(Event::kTakeoff).accepted);
}

TEST(Envelope, IsNotReadyUnderACeilingThatTheClimbWouldBreach) {
  MissionConfig config;
  for (const double ceiling : {1.9, 2.1}) {
    config.geofence = Box(10.0, ceiling);
    Bench bench(config);
    bench.Run(0.2);
    const world::CommandAnswer answer = bench.Command(Event::kTakeoff);
    EXPECT_EQ(answer.accepted, ceiling > 2.0);
    if (ceiling > 2.0) continue;
    EXPECT_NE(answer.reason.find("ceiling of 1.9 m is below climb_height, 2 m: raise"),
              std::string::npos)
        << answer.reason;
  }
}

TEST(ClimbColumn, AgreesWithPointsOfTheSolids) {
  for (unsigned seed = 1; seed <= 400; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-2.0, 2.0), half(0.1, 1.0), unit(-1.0, 1.0);
    world::Obstacle o;
    const Vector3d c(place(random), place(random), place(random) + 1.0);
    o.center = world::Trajectory::Constant(c, 0.0, 1.0);
    o.solid = static_cast<world::Obstacle::Solid>(random() % 3);
    const Vector3d h(half(random), half(random), half(random));
    const Eigen::Matrix3d R =
        Eigen::AngleAxisd(unit(random) * M_PI, Vector3d(unit(random), 1.0, 0.0).normalized())
            .toRotationMatrix();
    o.half = o.solid == world::Obstacle::Solid::kCylinder ? Vector3d(h.x(), h.x(), h.z()) : h;
    o.axes = Eigen::Quaterniond(R);
    o.shape = R * h.cwiseAbs2().cwiseInverse().asDiagonal() * R.transpose();
    double nearest = 1e9;  // of many points of the solid to the column's axis
    for (int i = 0; i < 4000; ++i) {
      Vector3d u(unit(random), unit(random), unit(random));
      Vector3d x;
      if (o.solid == world::Obstacle::Solid::kBox)
        x = c + R * u.cwiseProduct(o.half);
      else if (o.solid == world::Obstacle::Solid::kCylinder)
        x = c + (u.head<2>().norm() > 1.0 ? Vector3d::Zero() : u).cwiseProduct(o.half);
      else
        x = c + R * (u.norm() > 1.0 ? Vector3d(u.normalized()) : u).cwiseProduct(h);
      nearest = std::min(nearest, (x - Vector3d(0.0, 0.0, std::clamp(x.z(), 0.0, 2.0))).norm());
    }
    const bool blocked = world::IsColumnBlocked({o}, Vector3d::Zero(), 0.25, 2.0);
    EXPECT_TRUE(nearest > 0.22 || blocked) << "seed " << seed << ", " << nearest;
    EXPECT_TRUE(nearest < 0.45 || !blocked) << "seed " << seed << ", " << nearest;
    o.ground = true;
    EXPECT_FALSE(world::IsColumnBlocked({o}, Vector3d::Zero(), 0.25, 2.0)) << "what it stands on";
  }
}

// Along its axes a thin ellipsoid, grown by the radius, falls short of what the body touches.
TEST(ClimbColumn, TouchesThinPieces) {
  const Vector3d half(1.25, 0.02, 1.5);
  world::Obstacle o;
  o.center = world::Trajectory::Constant({0.0, 0.0, 1.0}, 0.0, 1.0);
  o.shape = half.cwiseAbs2().cwiseInverse().asDiagonal();
  for (int i = 0; i < 100; ++i) {
    const double angle = 0.5 * M_PI * i / 100;  // of a point at half its height
    const Vector3d point(half.x() * std::cos(angle), half.y() * std::sin(angle), 0.0);
    const Vector3d out = (o.shape * point).normalized();
    EXPECT_TRUE(world::IsColumnBlocked({o}, point + 0.249 * out, 0.25, 2.0)) << angle;
    EXPECT_FALSE(world::IsColumnBlocked({o}, point + 0.251 * out, 0.25, 2.0)) << angle;
  }
}

}  // namespace
}  // namespace chase::mission
