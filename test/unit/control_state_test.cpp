// What control makes of the mission's words: states and the fence.
#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "common/world/ages.h"
#include "test/unit/control_node_bench.h"

namespace chase::control {
namespace {

using test::Bench;
using test::kStart;

TEST(ControlNode, LandsWhenTheMissionSaysSoAndNobodyElse) {
  Bench bench;
  int64_t t = kStart;
  const auto following_after = [&](int8_t state, const std::string& sender) {
    bench.SendState(state, sender);
    bench.RunUntil(t);
    bench.SendPlan(t, {0, 0, 0});
    for (int i = 0; i < 20; ++i) bench.SendPose(t += 5000);
    return int{bench.tracking.back().following};
  };
  EXPECT_EQ(following_after(flight_state_t::HOLD, "mission"), int{tracking_t::PLAN});
  EXPECT_EQ(following_after(flight_state_t::LAND, "planning"), int{tracking_t::PLAN});
  EXPECT_EQ(following_after(flight_state_t::LAND, "mission"), int{tracking_t::LAND});
  EXPECT_EQ(bench.tracking.back().reason, "landing");
  EXPECT_EQ(bench.node().Report().state, bus::NodeReport::State::kOk);
  EXPECT_EQ(following_after(flight_state_t::HOLD, "mission"), int{tracking_t::PLAN});
}

TEST(ControlNode, AStateThatWasOvertakenChangesNothing) {
  Bench bench;
  int64_t t = kStart;
  const auto following_after = [&](int8_t state, int64_t age) {
    bench.SendState(state, "mission", {}, age);
    bench.RunUntil(t);
    bench.SendPlan(t, {0, 0, 0});
    for (int i = 0; i < 20; ++i) bench.SendPose(t += 5000);
    return int{bench.tracking.back().following};
  };
  EXPECT_EQ(following_after(flight_state_t::HOLD, 0), int{tracking_t::PLAN});
  EXPECT_EQ(following_after(flight_state_t::LAND, 0), int{tracking_t::LAND});
  EXPECT_EQ(following_after(flight_state_t::HOLD, 150000), int{tracking_t::LAND});
  EXPECT_EQ(following_after(flight_state_t::HOLD, 0), int{tracking_t::PLAN});
}

TEST(ControlNode, ComesDownOnlyByAPlanThatWasMadeToLand) {
  Bench bench;
  int64_t t = kStart;
  const auto following = [&] {
    for (int i = 0; i < 20; ++i) bench.SendPose(t += 5000);
    return int{bench.tracking.back().following};
  };
  bench.SendState(flight_state_t::HOLD);
  bench.SendPlan(t, {0, 0, 0});
  EXPECT_EQ(following(), int{tracking_t::PLAN});
  bench.SendState(flight_state_t::LAND);
  EXPECT_EQ(following(), int{tracking_t::PLAN}) << "of before";
  bench.SendState(flight_state_t::LAND);
  bench.SendPlan(t, {3, 0, 0});
  bench.SendPlan(t, {0, 0, 0});
  EXPECT_EQ(following(), int{tracking_t::LAND});
}

TEST(ControlNode, BrakingForWantOfTimeIsPartOfALanding) {
  Bench bench;
  int64_t t = kStart;
  bench.velocity = {1.5, 0, 0};  // it never rests
  bench.SendPlan(t, {0, 0, 0}, 60.0);
  bench.SendPose(t);
  while (bench.tracking.empty() || bench.tracking.back().following != tracking_t::BRAKE) {
    ASSERT_LT(t, kStart + 50'000'000);
    if (t % 200'000 == 0) bench.SendState(flight_state_t::LAND);
    bench.SendPose(t += 5000);
  }
  EXPECT_GT(t, kStart + 44'000'000);
  EXPECT_EQ(bench.tracking.back().reason, "landing: braking first");
  EXPECT_EQ(bench.node().Report().state, bus::NodeReport::State::kOk);
  bench.SendPose(t += 5000, pose_t::HEALTH_LOST);
  EXPECT_EQ(bench.node().Report().state, bus::NodeReport::State::kFailed);
}

TEST(ControlNode, BrakingForWantOfAPlanIsNoPartOfALanding) {
  Bench bench;
  int64_t t = kStart;
  bench.SendPlan(t, {0, 0, 0}, 60.0);
  bench.SendPose(t);
  bench.SendState(flight_state_t::LAND);
  for (int i = 0; i < 20; ++i) bench.SendPose(t += 5000, pose_t::HEALTH_OK, 1);
  EXPECT_EQ(int{bench.tracking.back().following}, int{tracking_t::BRAKE});
  EXPECT_EQ(bench.tracking.back().reason, "no plan: braking");
  EXPECT_EQ(bench.node().Report().state, bus::NodeReport::State::kFailed);
}

/// Is a plan from rest to rest flown by a body `at` [m] from the take-off place, within a fence of
/// 1 m around that and 2 m above?
bool IsFlown(const Eigen::Vector3d& at, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
             bool knows_home = true, int8_t verdict = plan_t::CHASE, bool is_told = false) {
  ControlConfig config;
  if (!is_told) {
    config.geofence.polygon = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    config.geofence.ceiling = 2.0;
  }
  Bench bench(true, config);
  bench.SendState(flight_state_t::CHASE, "mission",
                  knows_home ? std::optional<Eigen::Vector3d>(-at) : std::nullopt);
  if (is_told) bench.SendFence(-at);
  bench.SendWall(kStart);
  bench.SendPose(kStart);  // at [0, 0, 0]
  plan_t plan = Bench::Certified(kStart + 5000, from - at);
  plan.verdict = verdict;
  plan.position.n_coefficients = 18;
  for (const double share : {0.0, 0.0, 10.0, -15.0, 6.0})
    for (int i = 0; i < 3; ++i) plan.position.coefficients.push_back(share * (to - from)[i]);
  bench.Send(plan);
  bench.SendPose(kStart + 5000);
  return !bench.out.empty();
}

TEST(ControlNode, FliesNoPlanThatLeavesTheFence) {
  const Eigen::Vector3d middle(0, 0, 0), inside(0.85, 0, 0), outside(1.1, 0, 0), above(0, 0, 2.1);
  EXPECT_TRUE(IsFlown(middle, middle, {0.85, 0, 1.85}));
  EXPECT_FALSE(IsFlown(middle, middle, outside));
  EXPECT_FALSE(IsFlown(middle, middle, above));
  EXPECT_FALSE(IsFlown(middle, middle, {0.9, 0, 0})) << "the body keeps to its plan by 0.12 m";
  EXPECT_TRUE(IsFlown({0.95, 0, 0}, {0.95, 0, 0}, {0.9, 0, 0})) << "but leaves the edge";
  EXPECT_FALSE(IsFlown(inside, outside, {1.3, 0, 0})) << "planning is ahead of the body";
  EXPECT_TRUE(IsFlown({1.5, 0, 0}, {1.5, 0, 0}, {1.2, 0, 0})) << "a way back";
  EXPECT_FALSE(IsFlown({1.5, 0, 0}, {1.5, 0, 0}, {1.6, 0, 0}));
  EXPECT_TRUE(IsFlown(middle, middle, outside, true, plan_t::BRAKE))
      << "what else there is stops later";
  EXPECT_TRUE(IsFlown(middle, middle, outside, true, plan_t::ESCAPE));
  EXPECT_FALSE(IsFlown(middle, middle, inside, false)) << "nobody knows where the fence is";
}

TEST(ControlNode, KeepsTheFenceThatMissionTellsWhereItHasNoneItself) {
  const Eigen::Vector3d middle(0, 0, 0), at(0.5, 0.3, 0);
  for (const bool is_told : {false, true}) {
    EXPECT_TRUE(IsFlown(at, at, {0.85, 0, 1.85}, true, plan_t::CHASE, is_told)) << is_told;
    EXPECT_FALSE(IsFlown(at, at, {1.1, 0, 0}, true, plan_t::CHASE, is_told)) << is_told;
    EXPECT_FALSE(IsFlown(middle, middle, {0, 0, 2.1}, true, plan_t::CHASE, is_told)) << is_told;
  }
}

// A mission process that began anew in flight knows neither place nor fence.
TEST(ControlNode, RemembersPlaceAndFenceWhenMissionDies) {
  Bench bench;
  bench.SendState(flight_state_t::CHASE, "mission", Eigen::Vector3d(0, 0, 0));
  bench.SendFence({0, 0, 0});
  bench.SendState(flight_state_t::HOLD);
  bench.SendWall(kStart);
  bench.SendPose(kStart);
  bench.Send(Bench::Certified(kStart + 5000, {0, 0, 0}));
  bench.SendPose(kStart + 5000);
  ASSERT_EQ(bench.out.size(), 1u) << "it goes on inside";
  plan_t out = Bench::Certified(kStart + 10000, {0.3, 0, 0});
  out.position.coefficients[1] = -1.5;
  bench.Send(out);
  bench.SendPose(kStart + 10000);
  EXPECT_NE(bench.node().Report().detail.find("1 refused"), std::string::npos)
      << bench.node().Report().detail;
}

TEST(ControlNode, TellsAMissionThatBeganAnewWhereItTookOffAndWhatItSaidLast) {
  Bench bench;
  bench.SendState(flight_state_t::READY);
  bench.SendState(flight_state_t::TAKEOFF, "mission", Eigen::Vector3d(1, 2, 3));
  bench.SendState(flight_state_t::RETURN, "mission", Eigen::Vector3d(1, 2, 3));
  bench.RunUntil(kStart + 5000);
  EXPECT_TRUE(bench.homes.empty()) << "nobody has forgotten anything";
  bench.SendState(flight_state_t::HOLD);
  bench.RunUntil(kStart + 10000);
  ASSERT_EQ(bench.homes.size(), 1u);
  EXPECT_EQ(bench.homes[0].has_home, 1);
  EXPECT_EQ(bench.homes[0].state, +flight_state_t::RETURN);
  EXPECT_EQ(bus::ToVector(bench.homes[0].home), Eigen::Vector3d(1, 2, 3));
}

TEST(ControlNode, ADescentGoesOnWhileAMissionThatBeganAnewFindsOut) {
  Bench bench;
  int64_t t = kStart;
  const auto following_after = [&](int8_t state, const std::optional<Eigen::Vector3d>& home,
                                   int64_t silent = 0) {
    bench.RunUntil(t += silent);
    bench.SendState(state, "mission", home);
    bench.RunUntil(t);
    bench.SendPlan(t, {0, 0, 0});
    for (int i = 0; i < 20; ++i) bench.SendPose(t += 5000);
    return int{bench.tracking.back().following};
  };
  const Eigen::Vector3d home(1, 2, 3);
  EXPECT_EQ(following_after(flight_state_t::LAND, home), int{tracking_t::LAND});
  EXPECT_EQ(following_after(flight_state_t::IDLE, {}), int{tracking_t::LAND});
  EXPECT_EQ(following_after(flight_state_t::HOLD, home), int{tracking_t::PLAN});
  EXPECT_EQ(following_after(flight_state_t::LAND, home), int{tracking_t::LAND});
  EXPECT_EQ(int{bench.out.back().motors}, int{attitude_setpoint_t::MOTORS_ON});
  EXPECT_EQ(following_after(flight_state_t::HOLD, {}, 2'100'000), int{tracking_t::PLAN})
      << "it knows of no place, and leads all the same";
  following_after(flight_state_t::LAND, home);
  following_after(flight_state_t::DONE, {});
  EXPECT_EQ(int{bench.out.back().motors}, int{attitude_setpoint_t::MOTORS_OFF}) << "killed";
}

constexpr const char* kStands =
    "arming: in OFFBOARD; mode OFFBOARD, disarmed, on ground, battery 80 %";
constexpr const char* kArmed = "flying: armed and in OFFBOARD; mode OFFBOARD, armed, on ground";
constexpr const char* kFlies = "flying: armed and in OFFBOARD; mode OFFBOARD, armed, in air";
constexpr const char* kPilots = "pilot: the mode was changed; mode POSCTL, armed, in air";

TEST(ControlNode, IdlesOnTheGroundUntilTheAutopilotObeysAndAPlanBegins) {
  Bench bench;
  int64_t t = kStart;
  const auto run = [&](const char* words, int8_t state) {
    const size_t before = bench.out.size();
    for (int i = 0; i < 40; ++i) {
      if (i % 10 == 0) bench.SendAutopilot(words), bench.SendState(state);
      bench.SendPose(t += 5000);
    }
    return bench.out.size() - before;
  };
  EXPECT_EQ(run(kStands, flight_state_t::READY), 0u);
  EXPECT_EQ(run(kStands, flight_state_t::HOLD), 0u) << "an operator has stopped it";
  ASSERT_GE(run(kStands, flight_state_t::TAKEOFF), 39u);
  EXPECT_EQ(bench.out.back().motors, +attitude_setpoint_t::MOTORS_ON);
  EXPECT_EQ(bench.out.back().thrust, 0.0) << "PX4 takes min_thrust for a take-off";
  EXPECT_EQ(bench.tracking.back().following, +tracking_t::NONE);
  EXPECT_EQ(run(kStands, flight_state_t::READY), 0u) << "called off";
  EXPECT_EQ(bench.tracking.back().following, +tracking_t::NONE);
  bench.SendPlan(t, {0, 0, 1}, 60.0);
  EXPECT_EQ(run(kStands, flight_state_t::CHASE), 40u);
  EXPECT_EQ(bench.tracking.back().following, +tracking_t::NONE) << "it cannot climb";
  EXPECT_EQ(bench.out.back().thrust, 0.0);
  EXPECT_EQ(run(kArmed, flight_state_t::CHASE), 40u);
  EXPECT_EQ(bench.tracking.back().following, +tracking_t::PLAN);
  EXPECT_GT(bench.out.back().thrust, 10.0);
}

// Whoever plans errs, or plans for a flight that was called off or stopped.
TEST(ControlNode, NoPlanStartsTheMotorsOnTheGroundWhileNoFlightIsAskedFor) {
  for (const int8_t state : {flight_state_t::IDLE, flight_state_t::READY, flight_state_t::HOLD}) {
    Bench bench;
    int64_t t = kStart;
    const auto run = [&](const char* words, int8_t said) {
      const size_t before = bench.out.size();
      for (int i = 0; i < 40; ++i) {
        if (i % 10 == 0) bench.SendAutopilot(words), bench.SendState(said);
        bench.SendPose(t += 5000);
      }
      return bench.out.size() - before;
    };
    bench.SendPlan(t, {0, 0, 1}, 60.0);
    EXPECT_EQ(run(kStands, state), 0u) << int{state};
    EXPECT_EQ(bench.tracking.back().following, +tracking_t::NONE);
    EXPECT_EQ(run(kStands, flight_state_t::TAKEOFF), 40u);
    EXPECT_EQ(bench.out.back().thrust, 0.0);
    EXPECT_EQ(run(kStands, state), 0u) << "called off";
    EXPECT_EQ(run(kFlies, state), 40u) << "in the air whoever leads, it flies";
    EXPECT_EQ(bench.tracking.back().following, +tracking_t::PLAN);
    EXPECT_EQ(run(kStands, state), 40u) << "and on, to its landing";
  }
}

TEST(ControlNode, ALandingBeforeAFlightStopsTheMotors) {
  Bench bench;
  int64_t t = kStart;
  for (const int8_t state : {flight_state_t::TAKEOFF, flight_state_t::LAND}) {
    bench.SendAutopilot(kArmed);
    bench.SendState(state);
    for (int i = 0; i < 10; ++i) bench.SendPose(t += 5000);
    ASSERT_FALSE(bench.out.empty());
    EXPECT_EQ(bench.out.back().motors == attitude_setpoint_t::MOTORS_OFF,
              state == flight_state_t::LAND);
  }
}

TEST(ControlNode, ABodyInTheAirIsNotAskedToIdle) {
  Bench bench;
  bench.SendAutopilot(kPilots);
  bench.SendState(flight_state_t::TAKEOFF);
  for (int i = 0; i < 10; ++i) bench.SendPose(kStart + 5000 * i);
  EXPECT_TRUE(bench.out.empty());
}

TEST(ControlNode, AMissionThatFellSilentAsksForNoFlight) {
  Bench bench;
  bench.SendState(flight_state_t::TAKEOFF);
  for (int64_t t = kStart; t < kStart + 3'000'000; t += 50'000) {
    bench.SendAutopilot(kStands);
    bench.SendPose(t);
  }
  ASSERT_FALSE(bench.out.empty());
  EXPECT_NEAR(bus::Seconds(bench.out.back().utime, kStart), world::kMostAge.flight_state, 0.1);
}

// A body that a pilot holds 0.3 m below the plan: the thrust goes up by the error, and no further.
TEST(ControlNode, LearnsNothingWhileAPilotFlies) {
  const auto grows = [](const char* words) {
    Bench bench;
    bench.SendPlan(kStart, {0, 0, 0}, 60.0);
    double first = 0.0;
    int64_t t = kStart;
    for (int i = 0; i < 1000; ++i) {
      if (i % 200 == 0) bench.SendAutopilot(words);
      bench.height = i < 5 ? 0.0 : -0.3;
      bench.SendPose(t += 5000);
      if (i == 10) first = bench.out.back().thrust;
    }
    return bench.out.back().thrust - first;
  };
  EXPECT_GT(std::abs(grows(kFlies)), 0.5);
  EXPECT_NEAR(grows(kPilots), 0.0, 1e-9);
  EXPECT_NEAR(grows("landing: the pose is lost; mode AUTO.LAND, armed, in air"), 0.0, 1e-9);
  EXPECT_NEAR(grows("flying: armed; mode OFFBOARD, disarmed, on ground"), 0.0, 1e-9);
  EXPECT_GT(std::abs(grows("simulated, battery 80 %")), 0.5) << "nobody tells";
}

// The way down of a pilot is not felt as the ground.
TEST(ControlNode, IsNotDownWhileAPilotFlies) {
  // The autopilot may have been the first to notice.
  for (const char* words : {kFlies, "done: landed; mode AUTO.LAND, disarmed, on ground"}) {
    Bench bench;
    int64_t t = kStart;
    bench.SendPlan(t, {0, 0, 0}, 60.0);
    const auto run = [&](const char* said) {
      for (int i = 0; i < 1000; ++i) {
        if (i % 100 == 0) bench.SendAutopilot(said), bench.SendState(flight_state_t::LAND);
        bench.SendPose(t += 5000);
      }
      return bench.out.back().motors == attitude_setpoint_t::MOTORS_OFF;
    };
    EXPECT_FALSE(run(kPilots));
    EXPECT_TRUE(run(words)) << "what bears it is the ground";
  }
}

TEST(ControlNode, CutsTheMotorsInTheAirWhenTheFlightIsOverAndForGood) {
  Bench bench;
  int64_t t = kStart;
  bench.SendPlan(t, {0, 0, 0});
  for (int i = 0; i < 20; ++i) bench.SendPose(t += 5000);
  ASSERT_EQ(int{bench.out.back().motors}, int{attitude_setpoint_t::MOTORS_ON});
  bench.SendState(flight_state_t::DONE, "planning");
  bench.SendPose(t += 5000);
  EXPECT_EQ(int{bench.out.back().motors}, int{attitude_setpoint_t::MOTORS_ON})
      << "not its business";
  bench.SendState(flight_state_t::DONE);
  bench.SendPose(t += 5000);
  EXPECT_EQ(int{bench.out.back().motors}, int{attitude_setpoint_t::MOTORS_OFF});
  EXPECT_EQ(bench.out.back().thrust, 0.0);
  bench.SendState(flight_state_t::CHASE);
  bench.SendPlan(t, {0, 0, 0});
  for (int i = 0; i < 20; ++i) bench.SendPose(t += 5000);
  EXPECT_EQ(int{bench.out.back().motors}, int{attitude_setpoint_t::MOTORS_OFF});
  EXPECT_EQ(bench.tracking.back().reason, "the flight is over: motors off");
}

// As of a recording that somebody plays.
TEST(ControlNode, HearsNoFlightStateThatIsTooOld) {
  Bench bench;
  bench.SendPlan(kStart, {0, 0, 0});
  bench.SendPose(kStart);
  bench.SendState(flight_state_t::DONE, "mission", {}, 2100000);
  bench.SendPose(kStart + 5000);
  EXPECT_EQ(int{bench.out.back().motors}, int{attitude_setpoint_t::MOTORS_ON});
  bench.SendState(flight_state_t::DONE, "mission", {}, 1900000);
  bench.SendPose(kStart + 10000);
  EXPECT_EQ(int{bench.out.back().motors}, int{attitude_setpoint_t::MOTORS_OFF});
}

}  // namespace
}  // namespace chase::control
