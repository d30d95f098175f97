// What the pilot does under a mission process.

#include <gtest/gtest.h>

#include <cmath>

#include "services/planning/pilot.h"

namespace chase::planning {
namespace {

using Eigen::Vector3d;

constexpr double kPeriod = 0.005;  // s

world::Obstacle Pillar(int id, double x, double y) {
  world::Obstacle o;
  o.id = id;
  o.solid = world::Obstacle::Solid::kCylinder;
  o.half = {0.3, 0.3, 2.0};
  o.shape = (2.0 * o.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  o.center = world::Trajectory::Constant({x, y, 1.0}, 0.0, 1.0);
  return o;
}

/// Flies the pilot's plans perfectly; control says whether it flies.
class Flight {
 public:
  explicit Flight(const Vector3d& start = {0.0, 0.0, 0.1}) : rest_(start) {}

  void Run(double seconds) {
    for (const double end = t + seconds; t < end; t += kPeriod) {
      pilot.SetFlying(flying_before || flown.has_value());
      if (std::fmod(t, 0.1) < kPeriod) pilot.SetObstacles(t, obstacles);
      if (std::fmod(t, 0.3) < kPeriod && sees_target) pilot.SetForecast(Walking());
      if (const auto plan = pilot.Update(t, Body())) {
        plans.push_back(*plan);
        waiting_ = plan;
      }
      if (waiting_ && waiting_->trajectory.start <= t) flown = waiting_;
      for (const world::Obstacle& o : obstacles) {
        const Vector3d off = Body().p - o.center.Position(0.0);
        nearest = std::min(nearest, off.head<2>().norm() - o.half.x());
      }
    }
  }
  Forecast Walking() const {
    Forecast f;
    f.t = t;
    f.has_target = true;
    f.target = {t, 2.5, Eigen::MatrixXd::Zero(2, 3)};
    f.target.coefficients << 2.5 + 0.8 * t, 0.0, 0.5, 0.8 * 2.5, 0.0, 0.0;
    return f;
  }
  BodyEstimate Body() const {
    if (!flown) return {rest_, Vector3d::Zero(), 0.0};
    const double now = std::min(t, flown->trajectory.end());
    const bool over = t > flown->trajectory.end();
    return {flown->trajectory.Position(now),
            over ? Vector3d::Zero() : flown->trajectory.Velocity(now), 0.0};
  }
  /// In the air and chasing for so long.
  void Chase(double seconds) {
    pilot.SetTask(Task::kTakeoff, rest_);
    Run(5.0);
    pilot.SetTask(Task::kChase, rest_);
    sees_target = true;
    Run(seconds);
    sees_target = false;
  }
  const Vector3d& home() const { return rest_; }

  Pilot pilot{PlanningConfig()};
  double t = 0.0, nearest = 1e9;
  bool flying_before = false, sees_target = false;
  std::vector<world::Obstacle> obstacles;
  std::vector<PlanResult> plans;
  std::optional<PlanResult> flown;

 private:
  Vector3d rest_;
  std::optional<PlanResult> waiting_;
};

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
