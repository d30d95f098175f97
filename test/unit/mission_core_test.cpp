#include <gtest/gtest.h>

#include "common/world/ages.h"
#include "test/unit/mission_bench.h"

namespace chase::mission {
namespace {

TEST(Mission, IsReadyOnlyWhenNothingIsMissing) {
  Bench bench;
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.state(), State::kReady);
  struct Case {
    const char* what;
    void (*spoil)(Bench*);
    double after;  // s
  };
  const Case cases[] = {
      {"POSE is", [](Bench* b) { b->hears_pose = false; }, 0.2},
      {"odometry is not healthy: few points",
       [](Bench* b) {
         b->pose.healthy = false;
         b->pose.reason = "few points";
       },
       0.1},
      {"OBSTACLES is", [](Bench* b) { b->hears_obstacles = false; }, 0.4},
      {"9 of 10 good sweeps in a row", [](Bench* b) { b->HearSweeps(9); }, 0.1},
      {"TARGET is", [](Bench* b) { b->hears_target = false; }, 0.6},
      {"planning is", [](Bench* b) { b->failed.erase("planning"); }, 2.6},
      {"control has failed", [](Bench* b) { b->failed["control"] = true; }, 0.1},
      {"mapping has failed", [](Bench* b) { b->failed["mapping"] = true; }, 0.1},
      {"the autopilot says that it is in the air",
       [](Bench* b) { b->mission.inputs().armed = true; }, 0.1},
  };
  for (const Case& c : cases) {
    Bench one;
    one.Run(0.5);
    ASSERT_EQ(one.mission.state(), State::kReady) << c.what;
    c.spoil(&one);
    one.Run(c.after + 0.1);
    EXPECT_EQ(one.mission.state(), State::kIdle) << c.what;
    ASSERT_EQ(one.mission.missing().size(), 1u) << c.what;
    EXPECT_EQ(one.mission.missing()[0].rfind(c.what, 0), 0u) << one.mission.missing()[0];
    const world::CommandAnswer answer = one.Command(Event::kTakeoff);
    EXPECT_FALSE(answer.accepted);
    EXPECT_NE(answer.reason.find(c.what), std::string::npos) << answer.reason;
  }
  Bench deaf;
  deaf.hears_pose = deaf.hears_obstacles = deaf.hears_target = false;
  deaf.failed.clear();
  deaf.Run(0.2);
  EXPECT_EQ(deaf.mission.missing().size(), 6u);
}

TEST(Mission, FliesFromTakeOffToLanding) {
  Bench bench;
  bench.Run(0.2);
  EXPECT_TRUE(bench.Command(Event::kTakeoff).accepted);
  EXPECT_EQ(bench.mission.state(), State::kTakeoff);
  bench.mission.inputs().plan_heard = bench.t + 0.05;
  bench.mission.inputs().plan_end = {0.0, 0.0, 1.2};
  bench.Run(1.0);
  EXPECT_EQ(bench.mission.state(), State::kTakeoff);
  bench.pose.p.z() = 1.15;
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.state(), State::kHold);
  EXPECT_TRUE(bench.Command(Event::kChase).accepted);
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.state(), State::kChase);
  bench.tracked = false;
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.state(), State::kSearch);
  bench.tracked = true;
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.state(), State::kChase);
  bench.pose.p = {4.0, 0.0, 1.2};
  bench.Run(0.2);
  EXPECT_TRUE(bench.Command(Event::kReturn).accepted);
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.state(), State::kReturn);
  bench.pose.p = {0.1, -0.1, 1.2};
  bench.pose.v = {0.5, 0.0, 0.0};
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.state(), State::kReturn) << "still moving";
  bench.pose.v.setZero();
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.state(), State::kLand);
  bench.mission.inputs().motors_off = true;
  bench.Run(0.1);
  EXPECT_EQ(bench.mission.state(), State::kDone);
  EXPECT_FALSE(bench.Command(Event::kTakeoff).accepted);
}

// A vehicle that does not lift off is at rest at the end of a plan that goes nowhere.
TEST(Mission, AClimbIsOverOnlyHalfOfItAboveHome) {
  Bench bench;
  bench.pose.p.z() = 7.0;
  bench.Run(0.2);
  ASSERT_TRUE(bench.Command(Event::kTakeoff).accepted);
  const double half = 0.5 * MissionConfig().climb_height;
  for (const double height : {0.0, half - 0.05, half + 0.05}) {
    bench.pose.p.z() = 7.0 + height;
    bench.mission.inputs().plan_heard = bench.t + 0.05;
    bench.mission.inputs().plan_end = bench.pose.p;
    bench.Run(1.0);
    EXPECT_EQ(bench.mission.state(), height > half ? State::kHold : State::kTakeoff) << height;
  }
}

TEST(Mission, SaysWhatPlanningKnowsOfTheGroundUntilControlComesDown) {
  Bench bench;
  bench.Fly();
  bench.mission.inputs().plan_reason = "holding";
  ASSERT_TRUE(bench.Command(Event::kLand).accepted);
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.Words(), "landing commanded");
  bench.mission.inputs().plan_reason = "landing, no level ground is known: here";
  bench.Run(0.2);
  const std::string words = "landing commanded; landing, no level ground is known: here";
  EXPECT_EQ(bench.mission.Words(), words);
  bench.mission.inputs().landing = true;
  bench.mission.inputs().plan_reason = "landing";
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.Words(), words);
  ASSERT_TRUE(bench.Command(Event::kHold).accepted);
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.Words(), "hold commanded");
}

TEST(Mission, AChangeOfFrameTurnsReturnIntoLand) {
  Bench bench;
  bench.Fly({3.0, 0.0, 1.0});
  bench.Command(Event::kReturn);
  bench.Run(0.2);
  ASSERT_EQ(bench.mission.state(), State::kReturn);
  ++bench.pose.epoch;
  bench.Run(0.1);
  EXPECT_EQ(bench.mission.state(), State::kLand);
}

TEST(Mission, ReturnInAnotherFrameIsALandingAtOnce) {
  Bench bench;
  bench.Fly({3.0, 0.0, 1.0});
  ++bench.pose.epoch;
  bench.Run(0.1);
  ASSERT_EQ(bench.mission.state(), State::kHold);
  const world::CommandAnswer answer = bench.Command(Event::kReturn);
  EXPECT_TRUE(answer.accepted);
  EXPECT_NE(answer.reason.find("not known"), std::string::npos) << answer.reason;
  EXPECT_EQ(bench.mission.state(), State::kLand);
}

TEST(Mission, WithoutAPoseItIsAnEmergencyUntilThereIsOne) {
  Bench bench;
  bench.Fly();
  bench.pose.usable = bench.pose.healthy = false;
  bench.Run(1.8);
  EXPECT_EQ(bench.mission.state(), State::kHold) << "control brakes and waits as long";
  bench.Run(0.4);
  EXPECT_EQ(bench.mission.state(), State::kEmergency);
  EXPECT_FALSE(bench.Command(Event::kChase).accepted);
  bench.pose.usable = true;
  bench.Run(0.1);
  EXPECT_EQ(bench.mission.state(), State::kHold);
  bench.hears_pose = false;
  bench.Run(2.2);
  EXPECT_EQ(bench.mission.state(), State::kEmergency);
  bench.mission.inputs().motors_off = true;
  bench.Run(0.1);
  EXPECT_EQ(bench.mission.state(), State::kDone);
}

TEST(Mission, ALandingGoesOnOnceThereIsAPoseAgain) {
  Bench bench;
  bench.Fly();
  ASSERT_TRUE(bench.Command(Event::kLand).accepted);
  bench.pose.usable = bench.pose.healthy = false;
  bench.Run(2.2);
  ASSERT_EQ(bench.mission.state(), State::kEmergency);
  bench.pose.usable = true;
  bench.Run(0.1);
  EXPECT_EQ(bench.mission.state(), State::kLand) << bench.mission.reason();
}

TEST(Mission, AReturnGoesOnOnceThereIsAPoseAgain) {
  Bench bench;
  bench.Fly({3.0, 0.0, 1.0});
  ASSERT_TRUE(bench.Command(Event::kReturn).accepted);
  bench.pose.usable = bench.pose.healthy = false;
  bench.Run(2.2);
  ASSERT_EQ(bench.mission.state(), State::kEmergency);
  bench.pose.usable = true;
  bench.Run(0.1);
  EXPECT_EQ(bench.mission.state(), State::kReturn) << bench.mission.reason();
  bench.pose.usable = false;
  bench.Run(2.2);
  ASSERT_EQ(bench.mission.state(), State::kEmergency);
  bench.pose.usable = true;
  ++bench.pose.epoch;
  bench.Run(0.1);
  EXPECT_EQ(bench.mission.state(), State::kLand) << "the take-off place is not known any more";
}

TEST(Mission, LandsWithoutPlansOrObstaclesThatStayAway) {
  struct Silence {
    bool Bench::*hears;
    const char* reason;
  };
  for (const auto& [hears, reason] :
       {Silence{&Bench::hears_plans, "planning is silent: landing here"},
        Silence{&Bench::hears_obstacles, "obstacles are not heard of: landing here"}})
    for (const Event led : {Event::kHold, Event::kChase, Event::kReturn}) {
      Bench bench;
      bench.Fly({3.0, 0.0, 1.0});
      bench.mission.inputs().flying = bench.mission.inputs().armed = true;
      bench.Run(20.0);
      ASSERT_TRUE(bench.Command(led).accepted);
      bench.Run(0.2);
      const State before = bench.mission.state();
      bench.*hears = false;
      bench.Run(world::kMostAge.plan - 0.2);
      EXPECT_EQ(bench.mission.state(), before) << "it may come back: " << reason;
      bench.Run(0.4);
      EXPECT_EQ(bench.mission.state(), State::kLand);
      EXPECT_EQ(bench.mission.reason(), reason);
    }
}

// Planning hovers then, and says so with a plan each time.
TEST(Mission, WithoutForecastsTheTargetIsLostAndItReturnsInTime) {
  for (const bool heard : {true, false}) {  // otherwise started in flight, prediction dead by then
    MissionConfig config;
    config.give_up = 5.0;
    Bench bench(config);
    bench.hears_prediction = heard;
    bench.Fly({3.0, 0.0, 1.0});
    ASSERT_TRUE(bench.Command(Event::kChase).accepted);
    bench.Run(5.0);
    ASSERT_EQ(bench.mission.state(), State::kChase) << "prediction says that it is well";
    bench.hears_prediction = false;
    bench.failed.erase("prediction");
    const double most = heard ? world::kMostAge.prediction : world::kMostAge.status;
    bench.Run(most - 0.2);
    EXPECT_EQ(bench.mission.state(), State::kChase);
    bench.Run(0.4);
    EXPECT_EQ(bench.mission.state(), State::kSearch);
    EXPECT_EQ(bench.mission.reason().rfind(
                  heard ? "target lost: PREDICTION is 1." : "target lost: prediction is 2.", 0),
              0u)
        << bench.mission.reason();
    bench.Run(4.5);
    EXPECT_EQ(bench.mission.state(), State::kSearch) << "though perception tracks it";
    bench.Run(1.0);
    EXPECT_EQ(bench.mission.state(), State::kReturn);
    ASSERT_TRUE(bench.Command(Event::kSearch).accepted);
    bench.hears_prediction = true;
    bench.Run(0.2);
    EXPECT_EQ(bench.mission.state(), State::kChase) << "it is back";
  }
}

TEST(Mission, StartedInTheAirItIsNoTakeOffButAFlightOnceControlFlies) {
  Bench bench;
  bench.mission.inputs().armed = true;
  bench.Run(1.0);
  EXPECT_EQ(bench.mission.state(), State::kIdle);
  EXPECT_FALSE(bench.Command(Event::kTakeoff).accepted) << "a pilot hovers it";
  bench.mission.inputs().flying = true;
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.state(), State::kHold);
  EXPECT_TRUE(bench.mission.missing().empty());
}

TEST(Mission, AReturnThatGetsNoFartherLands) {
  MissionConfig config;
  config.return_patience = 10.0;
  Bench bench(config);
  bench.Fly({20.0, 0.0, 1.0});
  ASSERT_TRUE(bench.Command(Event::kReturn).accepted);
  for (int i = 0; i < 30; ++i) {  // slowly, but it comes
    bench.pose.p.x() -= 0.4;
    bench.Run(8.0);
    ASSERT_EQ(bench.mission.state(), State::kReturn) << bench.pose.p.x();
  }
  for (int i = 0; i < 3; ++i) {  // to and fro
    bench.pose.p.x() += i % 2 == 0 ? 2.0 : -2.0;
    bench.Run(0.5);
    ASSERT_EQ(bench.mission.state(), State::kReturn) << i;
  }
  ASSERT_TRUE(bench.Command(Event::kReturn).accepted) << "the operator asks for patience";
  bench.Run(9.5);
  EXPECT_EQ(bench.mission.state(), State::kReturn);
  bench.Run(1.0);
  EXPECT_EQ(bench.mission.state(), State::kLand);
  EXPECT_EQ(bench.mission.reason(), "it gets no farther on its way back: landing here");
}

TEST(Mission, AReturnWithoutEndIsAskedForByNoPatience) {
  MissionConfig config;
  config.return_patience = 0.0;
  Bench bench(config);
  bench.Fly({20.0, 0.0, 1.0});
  ASSERT_TRUE(bench.Command(Event::kReturn).accepted);
  bench.Run(300.0);
  EXPECT_EQ(bench.mission.state(), State::kReturn);
}

TEST(Mission, StartedInFlightItHoldsOrGoesOnWithALanding) {
  Bench flying;
  flying.mission.inputs().flying = true;
  flying.Run(0.1);
  EXPECT_EQ(flying.mission.state(), State::kHold);
  EXPECT_FALSE(flying.mission.home().has_value());
  EXPECT_EQ((flying.Command(Event::kReturn), flying.mission.state()), State::kLand);

  Bench told;
  const Led chase{State::kChase, told.t, "chase commanded"};
  told.mission.Remember(told.t, {{1.0, 2.0, 0.0}, told.pose.epoch}, chase);
  told.mission.inputs().flying = true;
  told.Run(0.1);
  EXPECT_FALSE(told.mission.home().has_value()) << "of another flight, for all that is known";
  told.mission.Remember(told.t, {{1.0, 2.0, 0.0}, told.pose.epoch}, chase);
  told.mission.Remember(told.t, {{3.0, 4.0, 0.0}, told.pose.epoch}, chase);
  EXPECT_EQ(told.mission.home()->p, Eigen::Vector3d(1.0, 2.0, 0.0));
  EXPECT_EQ((told.Command(Event::kReturn), told.mission.state()), State::kReturn);

  Bench landing;
  landing.mission.inputs().flying = landing.mission.inputs().landing = true;
  landing.Run(0.1);
  EXPECT_EQ(landing.mission.state(), State::kLand) << "a landing goes on";

  Bench down;
  down.mission.inputs().motors_off = down.mission.inputs().flying = true;
  down.Run(0.1);
  EXPECT_EQ(down.mission.state(), State::kDone);
}

TEST(Mission, StartedInFlightItGoesOnAsItWasLedUnlessSomebodyHasCommanded) {
  MissionConfig config;
  for (const State before :
       {State::kReturn, State::kLand, State::kChase, State::kSearch, State::kHold}) {
    for (const bool commanded : {false, true}) {
      for (const int frames : {0, 1}) {
        for (const bool autostart : {false, true}) {
          config.autostart = autostart;
          Bench bench(config);
          bench.mission.inputs().flying = true;
          bench.tracked = false;
          bench.pose.p = {5.0, 0.0, 1.0};
          bench.Run(0.1);
          if (commanded) bench.Command(Event::kStop);
          bench.mission.Remember(bench.t, {{1.0, 2.0, 0.0}, bench.pose.epoch - frames},
                                 {before, bench.t, ""});
          bench.Run(0.2);
          const State expected = commanded                                ? State::kHold
                                 : before == State::kReturn && frames > 0 ? State::kLand
                                 : before == State::kChase                ? State::kSearch
                                                                          : before;
          EXPECT_EQ(bench.mission.state(), expected)
              << Name(before) << (commanded ? ", stopped" : "") << ", frame " << frames
              << (autostart ? ", by itself" : "");
        }
      }
    }
  }
}

// Its first FCU_STATUS comes before HOME or up to a second after it; `led` is what HOME tells.
TEST(Mission, StartedInFlightAStopHoldsAsBeforeWhatTheEnvelopeSays) {
  MissionConfig config;
  config.geofence.polygon = {{-9, -9}, {9, -9}, {9, 9}, {-9, 9}};
  for (const double charge : {1.0, 0.2, 0.05}) {
    for (const bool outside : {false, true}) {
      for (const bool status_first : {false, true}) {
        for (const bool stopped : {false, true}) {
          Led led{State::kHold, 3.0, stopped ? "stop commanded" : "hold commanded"};
          for (int restart = 1; restart <= 2; ++restart) {
            Bench bench(config);
            Inputs& inputs = bench.mission.inputs();
            const auto hear = [&] { inputs.battery = charge; };
            inputs.flying = true;
            inputs.battery.reset();
            bench.pose.p = {outside ? 9.5 : 5.0, 0.0, 1.0};
            if (status_first) hear();
            bench.Run(0.2);
            bench.mission.Remember(bench.t, {{0.0, 0.0, 0.0}, bench.pose.epoch}, led);
            bench.Run(0.5);
            hear();
            bench.Run(5.0);
            const State expected = stopped                   ? State::kHold
                                   : charge < 0.1            ? State::kLand
                                   : outside || charge < 0.3 ? State::kReturn
                                                             : State::kHold;
            EXPECT_EQ(bench.mission.state(), expected)
                << charge << (outside ? ", outside" : "") << (status_first ? "" : ", late")
                << ", restart " << restart;
            led = {bench.mission.state(), bench.mission.since(), bench.mission.Words()};
            if (restart < 2 || !stopped || charge < 0.1) continue;
            inputs.battery = 0.05;
            bench.Run(0.2);
            EXPECT_EQ(bench.mission.state(), State::kLand) << "one more limit";
          }
        }
      }
    }
  }
}

TEST(Mission, AStopThatItObeysBeforeItHasHeardOfTheBatteryHolds) {
  Bench bench;
  bench.mission.inputs().flying = true;
  bench.mission.inputs().battery.reset();
  bench.Run(0.2);
  ASSERT_TRUE(bench.Command(Event::kStop).accepted);
  bench.mission.inputs().battery = 0.05;
  bench.Run(5.0);
  EXPECT_EQ(bench.mission.state(), State::kHold);
}

/// How the mission process before this one led; control tells it anew for each that starts.
Led Emergency(const std::string& broke_off) {
  return {State::kEmergency, 3.0, "no pose: broke off " + broke_off};
}

// Once POSE is silent for 2 s control falls silent, too: nothing tells of a flight but HOME.
TEST(Mission, StartedInAnEmergencyItGoesOnUntilThereIsAPose) {
  for (const bool silent : {true, false}) {       // control
    for (const bool heard : {true, false}) {      // odometry, which has lost its way
      for (const double late : {0.1, 2.3}) {      // HOME
        for (const bool again : {false, true}) {  // a second restart
          Bench bench;
          bench.mission.inputs().flying = bench.mission.inputs().landing = !silent;
          bench.pose.usable = bench.pose.healthy = false;
          bench.hears_pose = heard;
          bench.Run(late);
          Led led = Emergency("CHASE");
          if (again) led.reason += "; fcu: failsafe: a failsafe of the autopilot";
          bench.mission.Remember(bench.t, {{1.0, 2.0, 0.0}, bench.pose.epoch}, led);
          EXPECT_EQ(bench.mission.state(), State::kEmergency);
          bench.Run(60.0);
          EXPECT_EQ(bench.mission.state(), State::kEmergency);
          EXPECT_EQ(bench.mission.since(), 3.0);
          EXPECT_EQ(bench.mission.Words(), "no pose: broke off CHASE");
          EXPECT_FALSE(bench.Command(Event::kHold).accepted);
          bench.pose.usable = bench.hears_pose = true;
          bench.mission.inputs().flying = true;
          bench.mission.inputs().landing = false;
          bench.Run(0.2);
          EXPECT_EQ(bench.mission.state(), State::kHold) << "as without a restart";
        }
      }
    }
  }
}

TEST(Mission, StartedInAnEmergencyNoCommandEndsIt) {
  for (const Event command : {Event::kHold, Event::kLand}) {
    Bench bench;
    bench.mission.inputs().flying = true;
    bench.hears_pose = false;
    bench.Run(0.1);
    ASSERT_TRUE(bench.Command(command).accepted) << "before it hears of it";
    bench.mission.Remember(bench.t, {{1.0, 2.0, 0.0}, bench.pose.epoch}, Emergency("RETURN"));
    bench.Run(1.0);
    EXPECT_EQ(bench.mission.state(), State::kEmergency);
    bench.hears_pose = true;
    bench.Run(0.2);
    EXPECT_EQ(bench.mission.state(), command == Event::kLand ? State::kLand : State::kHold);
  }
}

TEST(Mission, AnEmergencyThatIsOverIsNotGoneOnWith) {
  for (const bool flying : {true, false}) {
    Bench posed;
    posed.mission.inputs().flying = posed.mission.inputs().landing = flying;
    posed.Run(0.1);
    posed.mission.Remember(posed.t, {{1.0, 2.0, 0.0}, posed.pose.epoch}, Emergency("CHASE"));
    EXPECT_EQ(posed.mission.state(), flying ? State::kHold : State::kReady) << "there is a pose";
    EXPECT_EQ(posed.mission.home().has_value(), flying);
  }
  Bench down;
  down.mission.inputs().motors_off = true;
  down.hears_pose = false;
  down.Run(0.1);
  down.mission.Remember(down.t, {{1.0, 2.0, 0.0}, down.pose.epoch}, Emergency("CHASE"));
  EXPECT_EQ(down.mission.state(), State::kDone);

  Bench grounded;  // the autopilot has landed it
  grounded.mission.inputs().on_ground = grounded.mission.inputs().handed_over = true;
  grounded.hears_pose = false;
  grounded.Run(0.1);
  grounded.mission.Remember(grounded.t, {{1.0, 2.0, 0.0}, 3}, Emergency("CHASE"));
  grounded.Run(3.0);
  EXPECT_FALSE(IsAirborne(grounded.mission.state())) << grounded.mission.reason();
}

TEST(Mission, NoEmergencyIsMadeUpOfAnotherState) {
  for (const State before : {State::kChase, State::kLand, State::kDone, State::kReady}) {
    Bench bench;
    bench.hears_pose = false;
    bench.Run(0.1);
    bench.mission.Remember(bench.t, {{1.0, 2.0, 0.0}, bench.pose.epoch}, {before, 3.0, ""});
    bench.Run(60.0);
    EXPECT_EQ(bench.mission.state(), State::kIdle) << Name(before);
  }
}

TEST(Mission, WhatAnEmergencyBrokeOffOutlivesARestart) {
  for (const State before : {State::kLand, State::kReturn, State::kHold}) {
    for (const bool back : {true, false}) {  // the pose, before HOME
      Bench first, second;
      first.Fly({5.0, 0.0, 1.0});
      if (before == State::kLand) first.Command(Event::kLand);
      if (before == State::kReturn) first.Command(Event::kReturn);
      first.hears_pose = false;
      first.Run(2.2);
      ASSERT_EQ(first.mission.state(), State::kEmergency);
      second.pose.p = {5.0, 0.0, 1.0};
      second.mission.inputs().flying = second.mission.inputs().landing = true;
      second.hears_pose = back;
      second.Run(0.1);
      second.mission.Remember(second.t, *first.mission.home(),
                              {State::kEmergency, 3.0, first.mission.Words()});
      second.hears_pose = true;
      second.mission.inputs().landing = false;
      second.Run(0.2);
      EXPECT_EQ(second.mission.state(), before) << second.mission.reason();
    }
  }
}

/// A mission process in whose time the pose is back, told by HOME of the emergency that `first`
/// led.
Led AfterARestart(const MissionConfig& config, const Bench& first, bool back, State expected) {
  Bench second(config);
  Inputs& inputs = second.mission.inputs();
  second.pose.p = first.pose.p;
  inputs.flying = inputs.landing = true;
  inputs.battery = first.mission.inputs().battery;
  second.hears_pose = back;  // before HOME
  second.Run(0.1);
  second.mission.Remember(second.t, *first.mission.home(),
                          {State::kEmergency, 3.0, first.mission.Words()});
  second.hears_pose = true;
  inputs.landing = false;
  second.Run(5.0);
  EXPECT_EQ(second.mission.state(), expected) << second.mission.Words();
  return {second.mission.state(), second.mission.since(), second.mission.Words()};
}

TEST(Mission, WhoWasToldToHoldHoldsAfterAnEmergencyAndARestart) {
  MissionConfig config;
  config.autostart = true;
  for (const Event command : {Event::kHold, Event::kStop}) {
    for (const bool back : {true, false}) {
      Bench first(config);
      first.Run(0.5);
      ASSERT_TRUE(first.Command(command).accepted);
      first.hears_pose = false;
      first.Run(2.2);
      ASSERT_EQ(first.mission.state(), State::kEmergency);
      AfterARestart(config, first, back, State::kHold);
      first.hears_pose = true;
      first.Run(5.0);
      EXPECT_EQ(first.mission.state(), State::kHold) << "as without a restart";
    }
  }
}

TEST(Mission, AnEmergencyInAChaseByItselfIsFollowedByAChase) {
  MissionConfig config;
  config.autostart = true;
  for (const bool back : {true, false}) {
    Bench first(config);
    first.Run(0.5);
    ASSERT_EQ(first.mission.state(), State::kChase);
    first.hears_pose = false;
    first.Run(2.2);
    ASSERT_EQ(first.mission.state(), State::kEmergency);
    AfterARestart(config, first, back, State::kChase);
  }
}

TEST(Mission, AStopThatAnEmergencyBrokeOffHoldsAsBeforeWhatTheEnvelopeSays) {
  MissionConfig config;
  config.geofence.polygon = {{-9, -9}, {9, -9}, {9, 9}, {-9, 9}};
  for (const double charge : {1.0, 0.2}) {
    for (const bool outside : {false, true}) {
      for (const Event command : {Event::kHold, Event::kStop}) {
        for (const bool back : {true, false}) {
          Bench first(config);
          first.Fly({5.0, 0.0, 1.0});
          ASSERT_TRUE(first.Command(command).accepted);
          first.hears_pose = false;
          first.Run(2.2);
          first.pose.p.x() = outside ? 9.5 : 5.0;
          first.mission.inputs().battery = charge;
          ASSERT_EQ(first.mission.state(), State::kEmergency);
          const bool holds = command == Event::kStop || (!outside && charge > 0.3);
          const Led led = AfterARestart(config, first, back, holds ? State::kHold : State::kReturn);
          if (command != Event::kStop) continue;
          EXPECT_EQ(led.reason.rfind("stop commanded", 0), 0u)
              << "the next restart: " << led.reason;
        }
      }
    }
  }
}

TEST(Mission, AStopThatAnEmergencyBrokeOffIsToldOnceItIsOver) {
  MissionConfig config;
  config.geofence.polygon = {{-9, -9}, {9, -9}, {9, 9}, {-9, 9}};
  Bench bench(config);
  bench.Fly({5.0, 0.0, 1.0});
  bench.pose.p.x() = 9.5;
  bench.Run(0.2);
  ASSERT_EQ(bench.mission.state(), State::kReturn);
  ASSERT_TRUE(bench.Command(Event::kStop).accepted);
  bench.hears_pose = false;
  bench.Run(2.2);
  ASSERT_EQ(bench.mission.state(), State::kEmergency);
  bench.hears_pose = true;
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.reason(), "stop commanded: before the pose was lost");
  bench.mission.inputs().battery = 0.2;
  bench.Run(0.2);
  EXPECT_EQ(bench.mission.state(), State::kReturn) << "one more limit";
}

TEST(Mission, AnEmergencyTellsWhatWasCommandedBeforeHome) {
  Bench bench;
  bench.mission.inputs().flying = true;
  bench.hears_pose = false;
  bench.Run(0.1);
  ASSERT_TRUE(bench.Command(Event::kStop).accepted);
  bench.mission.Remember(bench.t, {{1.0, 2.0, 0.0}, bench.pose.epoch}, Emergency("RETURN"));
  EXPECT_EQ(bench.mission.Words(), "no pose: broke off HOLD: stop commanded");
}

TEST(Mission, StartedInFlightItGivesUpTheSearchInItsTime) {
  Bench bench;
  bench.mission.inputs().flying = true;
  bench.tracked = false;
  bench.pose.p.x() = 5.0;
  bench.t = 100.0;
  bench.Run(0.1);
  bench.mission.Remember(bench.t, {{1.0, 2.0, 0.0}, bench.pose.epoch},
                         {State::kSearch, bench.t - 55.0, ""});
  bench.Run(4.9);
  EXPECT_EQ(bench.mission.state(), State::kSearch);
  bench.Run(0.3);
  EXPECT_EQ(bench.mission.state(), State::kReturn);
  EXPECT_EQ(bench.mission.reason(), "target not found in time");
}

TEST(Mission, GivesUpTheSearchInTime) {
  MissionConfig config;
  config.give_up = 5.0;
  Bench bench(config);
  bench.Fly();
  bench.tracked = false;
  bench.pose.p.x() = 3.0;
  bench.Command(Event::kSearch);
  bench.Run(4.8);
  EXPECT_EQ(bench.mission.state(), State::kSearch);
  bench.Run(0.4);
  EXPECT_EQ(bench.mission.state(), State::kReturn);
}

TEST(Mission, AutostartFliesByItselfUntilTheFirstCommand) {
  MissionConfig config;
  config.autostart = true;
  Bench bench(config);
  bench.Run(0.5);
  EXPECT_EQ(bench.mission.state(), State::kChase);
  bench.pose.usable = bench.pose.healthy = false;
  bench.Run(2.5);
  ASSERT_EQ(bench.mission.state(), State::kEmergency);
  bench.pose.usable = bench.pose.healthy = true;
  bench.Run(0.3);
  EXPECT_EQ(bench.mission.state(), State::kChase) << "it goes on";
  EXPECT_TRUE(bench.Command(Event::kStop).accepted);
  bench.Run(5.0);
  EXPECT_EQ(bench.mission.state(), State::kHold) << "the operator leads now";
}

}  // namespace
}  // namespace chase::mission
