// Ways that whoever hears no plan any more, or plans without lists, goes on by; and what is said
// where no tube is wide enough.
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>

#include "services/planning/stopping.h"
#include "test/unit/planning_pilot_flight.h"

namespace chase::planning {
namespace {

TEST(LastResort, ClaimsNothing) {
  for (const auto& [verdict, said] : {std::pair(Verdict::kChase, Verdict::kBrake),
                                      {Verdict::kSafeOnly, Verdict::kBrake},
                                      {Verdict::kEscape, Verdict::kMitigate},
                                      {Verdict::kBrake, Verdict::kBrake}}) {
    PlanResult plan;
    plan.verdict = verdict;
    plan.reason = "why";
    plan.certified_clearance = 0.1;
    plan.proofs.resize(2);
    plan.stop_proofs.resize(3);
    plan = AsLastResort("because", std::move(plan));
    EXPECT_EQ(plan.verdict, said);
    EXPECT_EQ(plan.reason, "because; why");
    EXPECT_LT(plan.certified_clearance, 0.0);
    EXPECT_TRUE(plan.proofs.empty());
    EXPECT_TRUE(plan.stop_proofs.empty());
  }
}

TEST(LastResort, AClimbThatNobodyWatchesAnyMoreEndsWhereItIs) {
  const PlanningConfig config;
  constexpr double kSlack = 0.03;  // m, of a braking that begins where the climb slows down
  Flight flight{config};
  flight.Run(2.0, false);
  ASSERT_GT(flight.plans.size(), 10u);
  for (const PlanResult& plan : flight.plans) {
    ASSERT_EQ(plan.reason, "climbing");
    ASSERT_TRUE(plan.stop);
    EXPECT_LT(plan.certified_clearance, 0.0);
    const world::Trajectory& stop = *plan.stop;
    EXPECT_LT((stop.Position(stop.start) - plan.trajectory.Position(stop.start)).norm(), 1e-9);
    EXPECT_LT((stop.Velocity(stop.start) - plan.trajectory.Velocity(stop.start)).norm(), 1e-9);
    EXPECT_LT(stop.Velocity(stop.end()).norm(), 1e-9);
    EXPECT_LT((stop.Position(stop.end()) - plan.trajectory.Position(0.0)).head<2>().norm(), 1e-9);
    EXPECT_LT(stop.Position(stop.end()).z(), 0.1 + config.takeoff_height + kSlack);
  }
  EXPECT_NEAR(flight.plans.front().stop->start, config.latency + kOverdue, 1e-9);
  EXPECT_GT(flight.plans.back().stop->start, 2.0);
  // The planner hangs 0.1 s into the climb.
  Flight hangs{config};
  hangs.Run(0.1, false);
  for (; hangs.t < 3.0; hangs.t += 0.1) EXPECT_LT(hangs.Body().p.z(), 0.3) << hangs.t;
}

/// A pillar beside a chase.
world::Obstacle Pillar(const Eigen::Vector3d& p) {
  world::Obstacle pillar;
  pillar.id = 7;
  pillar.solid = world::Obstacle::Solid::kCylinder;
  pillar.half = {0.2, 0.2, 3.0};
  pillar.shape = (2.0 * pillar.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  pillar.center = world::Trajectory::Constant(p, 0.0, 1.0);
  return pillar;
}

TEST(LastResort, WithoutListsItGoesOnAsCommitted) {
  Flight flight{PlanningConfig()};
  world::Obstacle walker = Pillar({-6.0, 4.0, 1.0});
  walker.moving = true;
  walker.half.head<2>().setConstant(0.3);
  flight.obstacles = {walker};
  flight.Run(4.0, false);
  flight.Run(4.0, true);
  flight.hears = false;
  const size_t seen = flight.plans.size();
  PlanResult committed;
  while (flight.plans.back().reason.find("not heard of") == std::string::npos) {
    committed = flight.plans.back();
    flight.Run(kPeriod, true);
    ASSERT_LT(flight.plans.size(), seen + 20);
  }
  ASSERT_TRUE(committed.stop);
  const double end = committed.stop->end();
  while (flight.plans.back().trajectory.start < end - 0.2) {
    const PlanResult& plan = flight.plans.back();
    EXPECT_LT(plan.certified_clearance, 0.0);
    if (plan.verdict != Verdict::kMitigate) {
      ASSERT_EQ(plan.verdict, Verdict::kBrake);
      const double speed = plan.trajectory.Velocity(plan.trajectory.start).norm() + 0.06;
      for (const world::Trajectory* way : {&plan.trajectory, plan.stop ? &*plan.stop : nullptr})
        for (double t = way ? way->start : 1.0; way && t < way->end(); t += 0.02)
          EXPECT_LT(way->Velocity(t).norm(), speed) << "it brakes";
    }
    for (double t = plan.trajectory.start; t < plan.trajectory.end(); t += 0.1) {
      const world::Trajectory& way =
          t < committed.stop->start ? committed.trajectory : *committed.stop;
      EXPECT_LT((plan.trajectory.Position(t) - way.Position(t)).norm(), 1e-6) << t;
    }
    flight.Run(0.1, true);
  }
  flight.Run(3.0, true);
  EXPECT_LT((flight.Body().p - committed.stop->Position(end)).norm(), 0.1);
}

TEST(LastResort, AClimbThatItsPlannerLeftIsNotGoneOnWithFromItsStop) {
  Flight flight{PlanningConfig()};
  flight.Run(0.5, false);
  flight.t += 1.0;  // the planner hangs
  ASSERT_TRUE(flight.flown && flight.flown->stop);
  ASSERT_GT(flight.t, flight.flown->stop->start);
  const Eigen::Vector3d p = flight.Body().p;
  const size_t before = flight.plans.size();
  flight.Run(0.1, false);
  ASSERT_GT(flight.plans.size(), before);
  EXPECT_LT((flight.Body().p - p).norm(), 0.1) << flight.plans.back().reason;
}

/// What is planned once lists of obstacles, a walker's among them, are no longer heard, and the
/// plan before that; with a fence at x, m, if any.
std::pair<PlanResult, PlanResult> WithoutLists(const std::optional<double>& x) {
  Flight flight{PlanningConfig()};
  world::Obstacle walker = Pillar({-6.0, 4.0, 1.0});
  walker.moving = true;
  flight.obstacles = {walker};
  flight.Run(4.0, false);
  flight.Run(4.0, true);
  flight.hears = false;
  if (x) {
    world::Geofence fence;
    fence.polygon = {{-20.0, -20.0}, {*x, -20.0}, {*x, 20.0}, {-20.0, 20.0}};
    flight.pilot.SetTask(Task::kChase, Eigen::Vector3d(0.0, 0.0, 0.0));
    flight.pilot.SetFence(fence);
  }
  PlanResult before;
  for (int i = 0; i < 200; ++i) {
    if (flight.plans.back().reason.find("not heard of") != std::string::npos) break;
    before = flight.plans.back();
    flight.Run(kPeriod, true);
  }
  return {before, flight.plans.back()};
}

TEST(LastResort, WhatWasCommittedToIsNotFlownOutOfTheFence) {
  const std::string committed = "the running plan until its stop";
  const auto [before, plan] = WithoutLists({});
  ASSERT_TRUE(before.stop);
  ASSERT_NE(plan.reason.find(committed), std::string::npos) << plan.reason;
  const double end = before.stop->Position(before.stop->end()).x();
  EXPECT_EQ(WithoutLists(end - 0.1).second.reason.find(committed), std::string::npos);
  EXPECT_NE(WithoutLists(end + 1.0).second.reason.find(committed), std::string::npos);
}

TEST(LastResort, WhatTheBodyStraysByBeyondAnyTubeIsTakenOffTheClaim) {
  const auto planned = [](double bound) {
    Pilot pilot{PlanningConfig()};
    pilot.SetFlying(true);
    pilot.SetTrackingBound(0.0, bound);
    pilot.SetObstacles(0.0, {Pillar({0.0, 1.3, 1.0})});
    pilot.SetForecast(Walking(0.0));
    return *pilot.Update(0.0, {{0.0, 0.0, 1.3}, {0.0, 0.0, 0.0}, 0.0});
  };
  const PlanResult widest = planned(kWidestTube), beyond = planned(kWidestTube + 0.05);
  ASSERT_GT(widest.certified_clearance, 0.05);
  EXPECT_NEAR(beyond.certified_clearance, widest.certified_clearance - 0.05, 1e-12);
  EXPECT_EQ(beyond.verdict, widest.verdict);
  const PlanResult far = planned(3.0);
  EXPECT_LT(far.certified_clearance, 0.0);
  EXPECT_GE(far.verdict, Verdict::kBrake);
  EXPECT_EQ(far.reason.find("the body strays farther than a plan keeps clear"), 0u) << far.reason;
  EXPECT_TRUE(far.proofs.empty());
}

TEST(LastResort, RestInPlaceOfAPlanThatIsNotFiniteClaimsNothing) {
  Pilot pilot{PlanningConfig()};
  pilot.SetFlying(true);
  pilot.SetObstacles(0.0, {Pillar({0.0, 1.3, 1.0})});
  pilot.SetForecast(Walking(0.0));
  const PlanResult rest = *pilot.Update(0.0, {{0.0, 0.0, 1.3}, {std::nan(""), 0.0, 0.0}, 0.0});
  EXPECT_TRUE(rest.trajectory.coefficients.allFinite());
  EXPECT_EQ(rest.reason.find("the plan is not finite"), 0u) << rest.reason;
  EXPECT_LT(rest.certified_clearance, 0.0);
  EXPECT_TRUE(rest.proofs.empty());
}

TEST(LastResort, AStopThatTheBodyMayStrayFromIsNoWayOut) {
  const PlanningConfig config;
  const double hard = config.planner.drone_radius + kWidestTube;
  int tighter = 0;
  for (double x = 0.0; x < 3.0; x += 0.2)
    for (double y = 0.9; y < 1.4; y += 0.1) {
      const auto planned = [&](double bound) {
        Pilot pilot{config};
        pilot.SetFlying(true);
        pilot.SetTrackingBound(0.0, bound);
        pilot.SetObstacles(0.0, {Pillar({x, y, 1.0})});
        pilot.SetForecast(Walking(0.0));
        return *pilot.Update(0.0, {{0.0, 0.0, 1.3}, {1.5, 0.0, 0.0}, 0.0});
      };
      const PlanResult plan = planned(kWidestTube);
      const double stops = LeastKept(plan.stop_proofs) - hard;
      if (!(stops + 0.02 < plan.certified_clearance)) continue;
      ++tighter;
      EXPECT_GE(planned(kWidestTube + stops - 0.01).certified_clearance, 0.0) << x << " " << y;
      const PlanResult beyond = planned(kWidestTube + stops + 0.01);
      EXPECT_LT(beyond.certified_clearance, 0.0) << x << " " << y;
      EXPECT_GE(beyond.verdict, Verdict::kBrake);
    }
  EXPECT_GT(tighter, 3);
}

}  // namespace
}  // namespace chase::planning
