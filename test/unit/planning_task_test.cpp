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

// Movers count for as long as is asked, and as the way lasts.
TEST(Climb, KeepsOffWhoComesInTime) {
  const PlannerConfig config;
  const world::Trajectory way{0.0, 3.0,
                              (Eigen::MatrixXd(2, 3) << 0.0, 0.0, 0.5, 0.0, 0.0, 1.0).finished()};
  const auto keeps_off = [&](double comes, double within) {
    PlanRequest request;
    request.horizon = within;
    request.start = way.At(0.0);
    world::Obstacle walker = Pillar(1, 0.0, 0.0);
    walker.moving = true;
    walker.center = {comes, 1.0, Eigen::MatrixXd::Zero(2, 3)};
    walker.center.coefficients(1, 0) = 4.0;  // past within half a second
    walker.center.coefficients(0, 2) = walker.half.z();
    request.obstacles = {walker};
    return KeepsOffMovers(config, request, way);
  };
  EXPECT_FALSE(keeps_off(0.8, 1.5));
  EXPECT_TRUE(keeps_off(2.2, 1.5));
  EXPECT_FALSE(keeps_off(2.2, 5.0));
  EXPECT_TRUE(keeps_off(4.0, 5.0));
}

TEST(Task, AClimbGoesOnCertifiedWithAPlannerThatIsStartedInIt) {
  for (const bool blocked : {false, true}) {
    Flight flight({0.0, 0.0, 0.6});
    flight.flying_before = true;
    if (blocked) {
      flight.obstacles = {Pillar(1, 0.0, 0.0)};
      flight.obstacles[0].half.z() = 0.1;
      flight.obstacles[0].center = world::Trajectory::Constant({0.0, 0.0, 1.3}, 0.0, 1.0);
    }
    flight.pilot.SetTask(Task::kTakeoff, Vector3d(0.0, 0.0, 0.1));
    flight.Run(8.0);
    for (const PlanResult& plan : flight.plans) EXPECT_GE(plan.certified_clearance, 0.0);
    if (blocked)
      EXPECT_LT(flight.Body().p.z(), 0.9);
    else
      EXPECT_NEAR(flight.Body().p.z(), 0.1 + PlanningConfig().takeoff_height, 0.05);
  }
}

// The sphere would pass, the sphere with its tube does not.
TEST(Task, NobodyClimbsBesideWhatTheTubeTouches) {
  for (const double gap : {0.31, 0.45}) {
    Flight flight;
    flight.obstacles = {Pillar(1, 0.3 + gap, 0.0)};
    flight.pilot.SetTask(Task::kTakeoff, flight.home());
    flight.Run(1.0);
    EXPECT_EQ(flight.plans.empty(), gap < PlanningConfig().planner.hard_radius()) << gap;
  }
}

TEST(Task, WhomItSawWhileItHeldIsLookedForWhereItWas) {
  Flight flight;
  flight.pilot.SetTask(Task::kTakeoff, flight.home());
  flight.sees_target = true;
  flight.Run(6.0);
  flight.pilot.SetTask(Task::kHold, flight.home());
  flight.Run(2.0);
  flight.sees_target = false;
  flight.Run(2.0);
  flight.pilot.SetTask(Task::kChase, flight.home());
  flight.Run(1.0);
  EXPECT_EQ(flight.plans.back().reason.rfind("target lost", 0), 0u) << flight.plans.back().reason;
}

TEST(Task, WhoWasNeverSeenIsWaitedForThenLookedFor) {
  Flight flight({0.0, 0.0, 1.5});
  flight.flying_before = true;
  flight.pilot.SetTask(Task::kChase, flight.home());
  flight.Run(9.0);
  EXPECT_EQ(flight.plans.back().reason, "nothing to chase yet");
  flight.Run(3.0);
  EXPECT_EQ(flight.plans.back().reason.rfind("target lost, looking around", 0), 0u);
}

TEST(Task, HoldBrakesAtOnceWithCertificates) {
  Flight flight;
  flight.Chase(8.0);
  const Vector3d before = flight.Body().p;
  ASSERT_GT(flight.Body().v.norm(), 0.4);
  flight.pilot.SetTask(Task::kHold, flight.home());
  const size_t chased = flight.plans.size();
  flight.sees_target = true;
  flight.Run(PlanningConfig().min_period + 2 * kPeriod);
  ASSERT_GT(flight.plans.size(), chased);
  EXPECT_EQ(flight.plans[chased].reason.rfind("holding", 0), 0u) << "at once";
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
  int legs = 0, with_stop = 0;
  for (size_t i = chased; i < flight.plans.size(); ++i) {
    EXPECT_GE(flight.plans[i].certified_clearance, 0.0) << flight.plans[i].reason;
    const bool leg = flight.plans[i].reason == "returning";
    legs += leg;
    with_stop += leg && flight.plans[i].stop;
  }
  EXPECT_GT(legs, 20);
  EXPECT_GT(with_stop, 0.9 * legs);
  EXPECT_GT(flight.nearest, PlanningConfig().planner.drone_radius);
  flight.obstacles.pop_back();
  flight.Run(30.0);
  EXPECT_LT((flight.Body().p - flight.home()).head<2>().norm(), 0.05);
  EXPECT_NEAR(flight.Body().p.z(), 0.1 + PlanningConfig().takeoff_height, 0.05);
  EXPECT_LT(flight.Body().v.norm(), 0.01);
}

// Nothing about the drone was seen: no stop can be certified there.
TEST(Task, AmongMoversNoLongWayBackIsFlownWithoutAStop) {
  for (const bool movers : {false, true}) {
    Flight flight;
    flight.obstacles = {Pillar(1, 0.0, 12.0)};
    flight.obstacles[0].moving = movers;
    flight.Chase(12.0);
    flight.pilot.SetTask(Task::kReturn, flight.home());
    world::Obstacle about = Pillar(9, flight.Body().p.x(), 0.0);
    about.half.head<2>().setConstant(4.0);
    const size_t chased = flight.plans.size();
    for (int i = 0; i < 30; ++i) {
      flight.pilot.SetUnseen(flight.t, {about});
      flight.Run(0.1);
    }
    int legs = 0, held = 0;
    for (size_t i = chased; i < flight.plans.size(); ++i) {
      const PlanResult& plan = flight.plans[i];
      legs += plan.trajectory.duration > 3.0 && !plan.stop;
      held += plan.reason.rfind("returning would have no stop", 0) == 0;
    }
    EXPECT_EQ(legs == 0, movers) << legs;
    EXPECT_EQ(held > 0, movers) << held;
  }
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

TEST(Task, ReturnOfAPlannerStartedFarFromHomeGoesStraightOn) {
  Flight flight({20.0, 5.0, 3.0});
  flight.flying_before = true;
  const Vector3d home(0.0, 0.0, 0.1);
  flight.pilot.SetTask(Task::kReturn, home);
  flight.Run(60.0);
  EXPECT_LT((flight.Body().p - home).head<2>().norm(), 0.05);
  EXPECT_NEAR(flight.Body().p.z(), 0.1 + PlanningConfig().takeoff_height, 0.05);
  for (const PlanResult& plan : flight.plans) EXPECT_GE(plan.certified_clearance, 0.0);
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

/// An L: along x to 14 m, and there along y.
world::Geofence Angle() {
  world::Geofence fence;
  fence.polygon = {{-2, -2}, {14, -2}, {14, 14}, {10, 14}, {10, 2}, {-2, 2}};
  return fence;
}

TEST(Task, ReturnAndLandingKeepToAConcaveFence) {
  const Vector3d home(-20.0, 7.0, 0.1), start = home + Vector3d(12.0, 4.0, 1.4);
  for (const Task task : {Task::kReturn, Task::kLand}) {
    Flight flight(start);
    flight.flying_before = true;
    // To land: on a block, in the middle of which it is; the fence has room on one side.
    world::Obstacle block = Pillar(1, 0.0, 0.0);
    block.half = {2.0, 2.0, 0.3};
    block.center =
        world::Trajectory::Constant({start.x() - 1.0, start.y(), block.half.z()}, 0.0, 1.0);
    block.shape = (2.0 * block.half.cwiseAbs2()).cwiseInverse().asDiagonal();
    if (task == Task::kLand) flight.obstacles = {block};
    flight.pilot.SetTask(task, home);
    flight.pilot.SetFence(Angle());
    flight.Run(25.0);
    for (const PlanResult& plan : flight.plans)
      for (const Vector3d& p : world::PlacesOn(plan.trajectory, std::nullopt))
        ASSERT_EQ(Angle().Breach(p - home, 0.1), "") << p.transpose();
    EXPECT_GT((flight.Body().p - start).norm(), 0.5) << "as far as it may";
  }
}

/// Where the way back along the trail ends, from the trail's end.
Vector3d Walk(const Trail& trail, const Vector3d& home, const world::Geofence& fence = {}) {
  PlanRequest request;
  request.start.p = trail.points().back();
  WayBack way_back;
  const auto in_fence = [&](const world::Trajectory& leg) {
    const auto places = world::PlacesOn(leg, std::nullopt);
    return fence.Refusal(request.start.p, places, 0.12).empty();
  };
  for (int i = 0; i < 60; ++i) {
    request.target = world::Trajectory::Constant(request.start.p, request.t0, 1.0);
    const auto leg = way_back.Leg({}, request, trail, home, nullptr, in_fence);
    if (!leg) break;
    EXPECT_TRUE(in_fence(leg->trajectory)) << request.start.p.transpose();
    request.t0 = leg->trajectory.end();
    request.start.p = leg->trajectory.Position(request.t0);
  }
  return request.start.p;
}

void Lead(const Vector3d& from, const Vector3d& to, Trail* trail) {
  for (int i = 0; i <= 100; ++i) trail->Add(from + 0.01 * i * (to - from));
}

TEST(Trail, ReachesBackDownhillAndUphill) {
  for (const double slope : {-0.3, 0.1}) {
    const Vector3d home(0.0, 0.0, 1.6), middle(15.0, 0.0, 1.6 + 15.0 * slope);
    Trail trail;
    Lead({0.0, 0.0, 0.1}, home, &trail);
    Lead(home, middle, &trail);
    Lead(middle, middle + Vector3d(0.0, 15.0, 15.0 * slope), &trail);
    EXPECT_LT((Walk(trail, home) - home).head<2>().norm(), 1e-6) << slope;
  }
}

TEST(Trail, LeadsAroundTheCornerOfAFence) {
  const Vector3d home(0.0, 0.0, 1.6), corner(12.0, 0.0, 1.6), end(12.0, 12.0, 1.6);
  Trail trail;
  Lead(home, corner, &trail);
  Lead(corner, end, &trail);
  EXPECT_LT((Walk(trail, home, Angle()) - home).norm(), 1e-6);
}

TEST(Trail, ThatBeginsElsewhereIsLedOnToHome) {
  const Vector3d home(0.0, 0.0, 1.6), start(30.0, 10.0, 4.0);
  Trail trail;
  Lead(start, start + Vector3d(0.0, 10.0, 0.0), &trail);
  EXPECT_LT((Walk(trail, home) - home).head<2>().norm(), 1e-6);
}

TEST(Trail, ThatClimbedSteeplyLeadsBackLevel) {
  const Vector3d home(0.0, 0.0, 1.6), low(12.0, 0.0, 1.6), high(12.0, 0.0, 3.4);
  Trail trail;
  Lead(home, low, &trail);
  Lead(low, high, &trail);
  EXPECT_LT((Walk(trail, home) - home).head<2>().norm(), 1e-6);
}

/// What both pilots are told from `t` on in a frame that is new to them: lists from the third tenth
/// of a second on, a target that walks faster than any before, and is lost.
void Tell(double since, const std::vector<world::Obstacle>& obstacles, double t, Pilot* pilot) {
  pilot->SetFlying(true);
  if (since > 0.25) {
    pilot->SetObstacles(t, obstacles);
    pilot->SetUnseen(t, {});
  }
  if (since < 2.0 || since > 4.0) return;
  Forecast f;
  f.t = t;
  f.has_target = true;
  f.target = {t, 2.5, Eigen::MatrixXd::Zero(2, 3)};
  f.target.coefficients << 3.0 + 1.3 * since, 0.0, 0.5, 1.3 * 2.5, 0.0, 0.0;
  pilot->SetForecast(f);
}

// In a new frame a pilot does what one does that has only just been started, bit for bit: nothing
// that was said in the old one is left, but that unseen places are told of.
TEST(Task, AfterAChangeOfFrameItIsAsIfItHadJustBeenStarted) {
  for (const Task task : {Task::kChase, Task::kHold, Task::kReturn, Task::kLand}) {
    Flight flight;
    flight.Chase(9.0);
    const Vector3d p = flight.Body().p;
    flight.Run(3.0);  // the target is lost
    flight.pilot.SetTask(task, flight.home());
    flight.Run(0.5);
    world::Obstacle everywhere = Pillar(9, p.x(), p.y() + 1.2);
    everywhere.half = {1.0, 1.0, 3.0};
    flight.pilot.SetUnseen(flight.t, {everywhere});
    flight.pilot.SetObstacles(flight.t, {everywhere});
    flight.pilot.ChangeFrame();
    Pilot fresh{PlanningConfig()};
    fresh.SetTask(task, std::nullopt);
    // A wall between the body and its home, around which the old way led.
    std::vector<world::Obstacle> obstacles;
    for (int i = -2; i <= 2; ++i) obstacles.push_back(Pillar(20 + i, 2.0, 0.5 * i));
    const BodyEstimate body{p, {0.1, 0.0, 0.0}, 0.2};
    int plans = 0;
    for (double since = 0.0; since < 9.0; since += 0.05) {
      const double t = flight.t + since;
      for (Pilot* pilot : {&flight.pilot, &fresh}) {
        Tell(since, obstacles, t, pilot);
        if (since > 1.0) pilot->SetTask(task, Vector3d(0.0, 0.0, 0.1));
      }
      const auto a = flight.pilot.Update(t, body), b = fresh.Update(t, body);
      ASSERT_EQ(a.has_value(), b.has_value()) << since;
      if (!a) continue;
      ++plans;
      ASSERT_EQ(a->verdict, b->verdict) << since << " " << a->reason << " / " << b->reason;
      ASSERT_EQ(a->reason, b->reason) << since;
      ASSERT_EQ(a->trajectory.coefficients, b->trajectory.coefficients) << since << a->reason;
      ASSERT_EQ(a->yaw, b->yaw) << since;
      ASSERT_EQ(a->stop.has_value(), b->stop.has_value()) << since;
      if (a->stop) {
        ASSERT_EQ(a->stop->coefficients, b->stop->coefficients) << since;
      }
    }
    EXPECT_GT(plans, 40);
  }
}

// Without a mission whoever may plan climbs; its node lets it after ten lists, when control has
// been heard.
TEST(Task, UnderAMissionItClimbsOnceControlIsHeard) {
  const PlanningConfig config;
  for (const bool heard : {false, true})
    for (const bool mission : {false, true}) {
      Pilot pilot(config);
      if (heard) pilot.SetFlying(false);
      if (mission) pilot.SetTask(Task::kTakeoff, Vector3d::Zero());
      double first = HUGE_VAL;
      for (double t = 5.0; t < 6.0 && first == HUGE_VAL; t += kPeriod) {
        pilot.SetObstacles(t, {});
        if (const auto plan = pilot.Update(t, {Vector3d(1.0, 2.0, 0.2), Vector3d::Zero(), 0.4})) {
          first = t - 5.0;
          const world::Trajectory& way = plan->trajectory;
          EXPECT_EQ(plan->reason, "climbing");
          EXPECT_EQ(way.duration, config.takeoff_time);
          EXPECT_NEAR(way.start, t + config.latency, 1e-9);
          EXPECT_LT((way.Position(way.start) - Vector3d(1.0, 2.0, 0.2)).norm(), 1e-9);
          EXPECT_LT(
              (way.Position(way.end()) - Vector3d(1.0, 2.0, 0.2 + config.takeoff_height)).norm(),
              1e-9);
          EXPECT_TRUE(world::EndsAtRest(way));
          EXPECT_LT(way.Velocity(way.start).norm() + way.Acceleration(way.start).norm(), 1e-9);
          EXPECT_EQ(plan->yaw, std::vector<double>{0.4});
        }
      }
      EXPECT_EQ(first, heard || !mission ? 0.0 : HUGE_VAL);
    }
}

// Told to go back twice, with a hold elsewhere between: the second way is a new one.
TEST(Task, ATaskThatIsGivenAgainBeginsAnew) {
  const auto plan_after = [](bool twice) {
    Flight flight;
    flight.Chase(9.0);
    if (twice) {
      flight.pilot.SetTask(Task::kReturn, flight.home());
      flight.Run(0.5);
      flight.pilot.SetTask(Task::kHold, flight.home());
      flight.Run(2.0);
    }
    flight.pilot.SetTask(Task::kReturn, flight.home());
    flight.Run(0.1);
    return flight.plans.back();
  };
  for (const bool twice : {false, true}) {
    const PlanResult plan = plan_after(twice);
    EXPECT_EQ(plan.reason, "returning");
    EXPECT_EQ(plan.verdict, Verdict::kSafeOnly);
    const Vector3d end = plan.trajectory.Position(plan.trajectory.end());
    EXPECT_LT((end - Vector3d(0.0, 0.0, 0.1 + PlanningConfig().takeoff_height)).norm(), 8.0);
    EXPECT_TRUE(world::EndsAtRest(plan.trajectory));
    EXPECT_GT((end - plan.trajectory.Position(plan.trajectory.start)).norm(), 1.0);
  }
}

// Nobody looks: neither back nor aside is a way, whatever was seen before.
TEST(Task, WithoutListsItNeitherReturnsNorIsLedAside) {
  for (const Task task : {Task::kReturn, Task::kLand}) {
    Flight flight;
    flight.Chase(9.0);
    const Vector3d p = flight.Body().p;
    flight.hears = false;
    flight.Run(0.4);
    flight.pilot.SetTask(task, flight.home());
    const size_t before = flight.plans.size();
    flight.Run(4.0);
    for (size_t i = before; i < flight.plans.size(); ++i) {
      EXPECT_NE(flight.plans[i].reason.find("obstacles are not heard of"), std::string::npos);
      EXPECT_LT(flight.plans[i].certified_clearance, 0.0);
    }
    EXPECT_LT((flight.Body().p - p).norm(), 1.5);
    EXPECT_LT(flight.Body().v.norm(), 0.02);
  }
}

// Lists count for 0.3 s, by when they were heard and not by when the plan begins.
TEST(Task, ListsCountUntilTheyAreOldWhateverItDoes) {
  for (const double age : {0.235, 0.34})
    for (const Task task : {Task::kHold, Task::kReturn, Task::kLand, Task::kChase}) {
      Flight flight;
      flight.Chase(9.0);
      if (task == Task::kChase) flight.pilot.SetTask(Task::kHold, flight.home());
      flight.sees_target = false;
      flight.hears = false;
      flight.pilot.SetObstacles(flight.t, {});
      flight.Run(age);
      flight.pilot.SetTask(task, flight.home());
      const size_t before = flight.plans.size();
      flight.Run(PlanningConfig().min_period + kPeriod);
      ASSERT_GT(flight.plans.size(), before);
      const PlanResult& plan = flight.plans[before];
      const bool heard = plan.reason.find("not heard of") == std::string::npos;
      EXPECT_EQ(heard, age < 0.3) << static_cast<int>(task) << " " << plan.reason;
      EXPECT_EQ(plan.certified_clearance >= 0.0, age < 0.3) << plan.reason;
      EXPECT_EQ(plan.reason == "returning", task == Task::kReturn && age < 0.3);
      EXPECT_EQ(plan.reason.find("landing, ") == 0 && heard, task == Task::kLand && age < 0.3);
    }
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
