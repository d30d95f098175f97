// What the pilot does under a mission process.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "test/unit/planning_flight.h"

namespace chase::planning {
namespace {

using Eigen::Vector3d;
using test::Flight;
using test::kPeriod;
using test::Pillar;

TEST(Task, OnTheGroundNothingIsPlannedUntilTakeOff) {
  for (const Task task : {Task::kGround, Task::kHold, Task::kReturn, Task::kDone}) {
    Flight flight;
    flight.pilot.SetTask(task, std::nullopt);
    flight.Run(3.0);
    EXPECT_TRUE(flight.plans.empty()) << static_cast<int>(task);
  }
}

TEST(Task, TakeOffClimbsAndHoversThoughATargetIsThere) {
  Flight flight;
  flight.pilot.SetTask(Task::kTakeoff, flight.home());
  flight.sees_target = true;
  flight.Run(8.0);
  EXPECT_LT((flight.Body().p - Vector3d(0, 0, 0.1 + PlanningConfig().takeoff_height)).norm(), 1e-6);
  EXPECT_EQ(flight.plans.back().verdict, Verdict::kWait);
  EXPECT_EQ(flight.plans.back().reason, "climbed");
}

TEST(Task, TheClimbBeginsWhenTheAutopilotObeys) {
  for (const Task task : {Task::kTakeoff, Task::kChase}) {
    Flight flight;
    flight.pilot.SetTask(task, flight.home());
    flight.pilot.SetWaiting(true);
    flight.Run(10.0);
    EXPECT_TRUE(flight.plans.empty());
    flight.pilot.SetWaiting(false);
    flight.Run(1.0);
    ASSERT_FALSE(flight.plans.empty());
    EXPECT_EQ(flight.plans.front().reason, "climbing");
    flight.pilot.SetWaiting(true);  // what is known grows old, or is wrong: it is under way
    flight.Run(7.0);
    EXPECT_LT((flight.Body().p - Vector3d(0, 0, 0.1 + PlanningConfig().takeoff_height)).norm(),
              1e-6);
  }
}

TEST(Task, StartedInFlightItBrakesAndNeverClimbs) {
  for (const Task task :
       {Task::kGround, Task::kTakeoff, Task::kHold, Task::kChase, Task::kReturn}) {
    Flight flight({0.0, 0.0, 1.5});
    flight.flying_before = true;
    flight.pilot.SetTask(task, std::nullopt);
    flight.Run(4.0);
    ASSERT_FALSE(flight.plans.empty()) << static_cast<int>(task);
    for (const PlanResult& plan : flight.plans) EXPECT_NE(plan.reason, "climbing");
    EXPECT_LT((flight.Body().p - Vector3d(0.0, 0.0, 1.5)).norm(), 0.05);
  }
}

TEST(Task, HoldBrakesAtOnceWithCertificates) {
  Flight flight;
  flight.Chase(8.0);
  const Vector3d before = flight.Body().p;
  ASSERT_GT(flight.Body().v.norm(), 0.4);
  flight.pilot.SetTask(Task::kHold, flight.home());
  const size_t chased = flight.plans.size();
  flight.sees_target = true;
  flight.Run(2 * kPeriod);
  ASSERT_EQ(flight.plans.size(), chased + 1) << "not only when the next plan is due";
  flight.Run(4.0);
  EXPECT_LT((flight.Body().p - before).norm(), 1.5);
  EXPECT_LT(flight.Body().v.norm(), 0.01);
  for (size_t i = chased; i < flight.plans.size(); ++i)
    EXPECT_GE(flight.plans[i].certified_clearance, 0.0);
  flight.pilot.SetTask(Task::kChase, flight.home());
  flight.Run(3.0);
  EXPECT_LE(flight.plans.back().verdict, Verdict::kSafeOnly) << "and goes on";
}

TEST(Task, StopEndsAClimb) {
  Flight flight;
  flight.pilot.SetTask(Task::kTakeoff, flight.home());
  flight.Run(1.2);
  flight.pilot.SetTask(Task::kHold, flight.home());
  flight.Run(4.0);
  EXPECT_LT(flight.Body().p.z(), 0.1 + 0.75 * PlanningConfig().takeoff_height);
  EXPECT_LT(flight.Body().v.norm(), 0.01);
}

TEST(Task, ReturnGoesBackAroundWhatStandsBetween) {
  Flight flight;
  flight.obstacles = {Pillar(1, 4.0, 1.5), Pillar(2, 4.0, -1.5)};
  flight.Chase(12.0);
  ASSERT_GT(flight.Body().p.x(), 6.0);
  flight.obstacles.push_back(Pillar(3, 5.0, 0.0));  // on the straight way, and on the one it came
  flight.nearest = 1e9;
  flight.pilot.SetTask(Task::kReturn, flight.home());
  const size_t chased = flight.plans.size();
  flight.Run(30.0);
  for (size_t i = chased; i < flight.plans.size(); ++i)
    EXPECT_GE(flight.plans[i].certified_clearance, 0.0) << flight.plans[i].reason;
  EXPECT_GT(flight.nearest, PlanningConfig().planner.drone_radius);
  flight.obstacles.pop_back();
  flight.Run(30.0);
  EXPECT_LT((flight.Body().p - flight.home()).head<2>().norm(), 0.05);
  EXPECT_NEAR(flight.Body().p.z(), 0.1 + PlanningConfig().takeoff_height, 0.05);
  EXPECT_LT(flight.Body().v.norm(), 0.01);
}

TEST(Task, ReturnWithoutAPlaceHolds) {
  Flight flight;
  flight.Chase(8.0);
  flight.pilot.ChangeFrame();
  flight.pilot.SetTask(Task::kReturn, std::nullopt);
  const Vector3d before = flight.Body().p;
  flight.Run(4.0);
  EXPECT_LT((flight.Body().p - before).norm(), 1.5);
  EXPECT_EQ(flight.plans.back().reason, "the take-off place is not known");
}

TEST(Task, ReturnOutOfAnObstaclesReachIsAnEscape) {
  Flight flight({0.64, 0.0, 1.6});
  flight.obstacles = {Pillar(1, 0.0, 0.0)};  // 0.34 m off: nearer than the hard radius
  flight.flying_before = true;
  flight.pilot.SetTask(Task::kReturn, Vector3d(6.0, 0.0, 0.1));
  flight.Run(20.0);
  int late = 0;
  for (const PlanResult& plan : flight.plans) {
    const bool leaves = std::any_of(plan.proofs.begin(), plan.proofs.end(),
                                    [](const Proof& proof) { return proof.from > 0.0; });
    late += leaves ? 1 : 0;
    EXPECT_EQ(plan.verdict == Verdict::kEscape, leaves) << plan.reason;
  }
  EXPECT_GT(late, 0);
  EXPECT_LT((flight.Body().p - Vector3d(6.0, 0.0, 1.6)).head<2>().norm(), 0.05);
}

TEST(Trail, LosesItsLoops) {
  Trail trail;
  const auto go = [&](const Vector3d& from, const Vector3d& to) {
    for (int i = 0; i <= 100; ++i) trail.Add(from + 0.01 * i * (to - from));
  };
  go({0, 0, 1}, {5, 0, 1});
  const size_t straight = trail.points().size();
  EXPECT_NEAR(static_cast<double>(straight), 10.0, 1.0);
  go({5, 0, 1}, {5, 5, 1});
  go({5, 5, 1}, {2, 5, 1});
  go({2, 5, 1}, {2, 0, 1});
  EXPECT_LE(trail.points().size(), 6u) << "back where it was after 2 m";
  for (size_t i = 1; i < trail.points().size(); ++i)
    EXPECT_LT((trail.points()[i] - trail.points()[i - 1]).norm(), 1.0);
}

}  // namespace
}  // namespace chase::planning
