#include <gtest/gtest.h>

#include <string>

#include "test/unit/mission_bench.h"

namespace chase::mission {
namespace {

TEST(Mission, SaysWhoElseFlies) {
  Bench bench;
  bench.Fly();
  bench.mission.inputs().autopilot = "pilot: the mode was changed: the pilot has it";
  bench.mission.inputs().handed_over = true;
  bench.Run(0.1);
  EXPECT_EQ(bench.mission.Words(),
            "hold commanded; fcu: pilot: the mode was changed: the pilot has it");
  bench.mission.inputs().handed_over = false;
  EXPECT_EQ(bench.mission.Words(), "hold commanded");
}

TEST(Mission, ATakeOffThatTheAutopilotRefusesIsCalledOff) {
  const auto refuse = [](Bench* bench, bool refused, bool on_ground, bool flying) {
    bench->mission.inputs().autopilot = refused ? "refused: no GPS" : "standby: a PX4 is heard";
    bench->mission.inputs().handed_over = refused;
    bench->mission.inputs().on_ground = on_ground;
    bench->mission.inputs().flying = flying;
  };
  for (const Event then : {Event::kTakeoff, Event::kHold, Event::kChase}) {
    Bench bench;
    bench.Run(0.2);
    ASSERT_TRUE(bench.Command(Event::kTakeoff).accepted);
    ASSERT_TRUE(then == Event::kTakeoff || bench.Command(then).accepted);
    refuse(&bench, true, true, false);
    bench.Run(2.4);
    ASSERT_TRUE(IsAirborne(bench.mission.state())) << "what is heard may be of before";
    bench.Run(0.3);
    ASSERT_EQ(bench.mission.state(), State::kReady) << Name(then);
    EXPECT_EQ(bench.mission.Words(), "take-off called off; fcu: refused: no GPS");
    refuse(&bench, false, true, false);
    bench.hears_target = false;
    bench.Run(1.0);
    ASSERT_EQ(bench.mission.state(), State::kIdle);
    EXPECT_NE(bench.mission.Words().find("; fcu: refused: no GPS"), std::string::npos);
    bench.hears_target = true;
    bench.Run(0.2);
    ASSERT_TRUE(bench.Command(Event::kTakeoff).accepted);
    bench.mission.inputs().motors_off = true;
    bench.Run(0.1);
    EXPECT_EQ(bench.mission.Words(), "motors are off") << "that was another one";
  }
}

TEST(Mission, ATakeOffThatNobodyBeginsIsCalledOffAfterAPatience) {
  MissionConfig config;
  config.takeoff_patience = 20.0;
  for (const bool autostart : {false, true}) {
    config.autostart = autostart;
    Bench bench(config);
    bench.mission.inputs().on_ground = true;
    bench.mission.inputs().autopilot = "arming: in OFFBOARD";
    bench.Run(0.2);
    ASSERT_TRUE(autostart || bench.Command(Event::kTakeoff).accepted);
    bench.Run(19.8);
    ASSERT_EQ(bench.mission.state(), autostart ? State::kChase : State::kTakeoff);
    bench.Run(30.0);
    EXPECT_EQ(bench.mission.state(), State::kReady) << "and does not begin again by itself";
    EXPECT_EQ(bench.mission.Words(), "take-off called off; fcu: arming: in OFFBOARD");
  }
}

TEST(Mission, ATakeOffThatTheEnvelopeEndsOnTheGroundIsCalledOff) {
  MissionConfig config;
  config.geofence.polygon = {{-9, -9}, {9, -9}, {9, 9}, {-9, 9}};
  for (const double charge : {0.2, 0.05, 1.0}) {  // or it is carried out of the fence
    for (const bool stopped : {false, true}) {
      Bench bench(config);
      bench.mission.inputs().on_ground = true;
      bench.Run(0.2);
      ASSERT_TRUE(bench.Command(Event::kTakeoff).accepted);
      bench.mission.inputs().battery = charge;
      if (charge == 1.0) bench.pose.p.x() = 9.5;
      bench.Run(stopped ? 0.0 : 0.1);
      if (stopped) {
        ASSERT_TRUE(bench.Command(Event::kStop).accepted);
        bench.Run(0.3);
      }
      EXPECT_EQ(bench.mission.state(), stopped && charge < 1.0 ? State::kHold : State::kReady);
      if (stopped) continue;
      EXPECT_EQ(bench.mission.reason(), charge < 1.0 ? "take-off called off: battery low"
                                                     : "take-off called off: outside the geofence");
      EXPECT_EQ(bench.Command(Event::kLand).accepted, false);
    }
  }
}

TEST(Mission, AKillWhileAPilotHasItIsRefusedAndSaysWhoCan) {
  for (const bool pilots : {true, false}) {
    Bench bench;
    bench.Fly();
    bench.mission.inputs().autopilot = pilots ? "pilot: the mode was changed: the pilot has it"
                                              : "failsafe: a failsafe of the autopilot";
    bench.mission.inputs().handed_over = true;
    bench.Run(0.1);
    const world::CommandAnswer answer =
        bench.mission.Obey(bench.t, {{"command", 1, 77, bench.t}, Event::kKill, true});
    EXPECT_EQ(answer.accepted, !pilots);
    EXPECT_EQ(answer.reason, pilots ? "a pilot has it: his kill switch cuts the motors"
                                    : "DONE: killed: motors cut by command");
    EXPECT_EQ(bench.mission.state(), pilots ? State::kHold : State::kDone);
  }
}

TEST(Mission, ATakeOffWhosePoseIsLostOnTheGroundIsCalledOff) {
  MissionConfig config;
  config.takeoff_patience = 20.0;
  for (const bool comes_back : {false, true}) {
    Bench bench(config);
    bench.mission.inputs().on_ground = true;
    bench.Run(0.2);
    ASSERT_TRUE(bench.Command(Event::kTakeoff).accepted);
    bench.hears_pose = false;
    bench.Run(10.0);
    ASSERT_EQ(bench.mission.state(), State::kEmergency);
    bench.hears_pose = comes_back;
    bench.Run(11.0);
    EXPECT_EQ(bench.mission.state(), comes_back ? State::kReady : State::kIdle);
  }
}

TEST(Mission, WhatFliesIsNotCalledOff) {
  for (const bool on_ground : {false, true}) {
    Bench bench;
    bench.Run(0.2);
    ASSERT_TRUE(bench.Command(Event::kTakeoff).accepted);
    bench.mission.inputs().handed_over = true;
    bench.mission.inputs().on_ground = on_ground;
    bench.mission.inputs().flying = on_ground;  // in the air control may have begun anew
    bench.mission.inputs().armed = on_ground;
    bench.Run(300.0);
    EXPECT_EQ(bench.mission.state(), State::kTakeoff) << on_ground;
  }
  MissionConfig config;
  config.takeoff_patience = 0.0;
  Bench bench(config);
  bench.Run(0.2);
  ASSERT_TRUE(bench.Command(Event::kTakeoff).accepted);
  bench.mission.inputs().on_ground = true;
  bench.Run(300.0);
  EXPECT_EQ(bench.mission.state(), State::kTakeoff) << "asked for by no patience";
}

/// In the air until PX4 says otherwise.
Bench Flying() {
  Bench bench;
  bench.Fly();
  bench.mission.inputs().flying = bench.mission.inputs().armed = true;
  bench.Run(3.0);
  EXPECT_TRUE(bench.Command(Event::kChase).accepted);
  bench.Run(0.2);
  return bench;
}

TEST(Mission, IsOverOnceTheAutopilotHasLandedIt) {
  for (const char* words : {"failsafe: a failsafe of the autopilot: Emergency battery level",
                            "pilot: the mode was changed: the pilot has it",
                            "done: landed and disarmed", "standby: the pilot may give it back"}) {
    for (const bool restarted : {false, true}) {  // control
      Bench bench = Flying();
      Inputs& inputs = bench.mission.inputs();
      inputs.autopilot = words;
      inputs.handed_over = std::string(words).find("standby") != 0;
      bench.Run(20.0);
      ASSERT_EQ(bench.mission.state(), State::kChase) << "it comes down; " << words;
      inputs.on_ground = true;
      inputs.flying = !restarted;
      bench.Run(5.0);
      ASSERT_EQ(bench.mission.state(), State::kChase) << "armed it may lift off again; " << words;
      inputs.disarmed = bench.t;
      bench.Run(0.1);
      EXPECT_EQ(bench.mission.state(), State::kDone) << words;
      EXPECT_EQ(bench.mission.Words(),
                std::string("the autopilot has landed and disarmed: ") + words);
    }
  }
}

TEST(Mission, IsOverInEveryStateThatFliesWhereTheAutopilotHasLandedIt) {
  for (const Event led : {Event::kHold, Event::kSearch, Event::kReturn, Event::kLand}) {
    Bench bench = Flying();
    bench.pose.p = {4.0, 0.0, 1.0};
    bench.tracked = false;
    bench.Run(0.2);
    ASSERT_TRUE(bench.Command(led).accepted);
    bench.mission.inputs().disarmed = bench.t;
    bench.Run(0.1);
    EXPECT_EQ(bench.mission.state(), State::kDone) << Name(led);
  }
  Bench bench = Flying();
  bench.hears_pose = false;
  bench.Run(3.0);
  ASSERT_EQ(bench.mission.state(), State::kEmergency);
  bench.mission.inputs().disarmed = bench.t;
  bench.Run(0.1);
  EXPECT_EQ(bench.mission.state(), State::kDone);
}

/// The motors are cut then: what PX4 has said before, and a status that is lost, must not do it.
TEST(Mission, IsNotOverByWhatTheAutopilotSaidBeforeItFlew) {
  for (const bool commanded : {false, true}) {  // otherwise found in flight
    Bench bench;
    bench.mission.inputs().disarmed = bench.t;
    bench.mission.inputs().on_ground = true;
    bench.Run(0.2);
    ASSERT_TRUE(!commanded || bench.Command(Event::kTakeoff).accepted);
    bench.Run(5.0);
    bench.mission.inputs().disarmed = bench.t;
    bench.mission.inputs().flying = bench.mission.inputs().armed = true;
    bench.Run(30.0);
    EXPECT_EQ(bench.mission.state(), commanded ? State::kTakeoff : State::kHold);
    bench.mission.inputs().disarmed = bench.t;
    bench.Run(0.1);
    EXPECT_EQ(bench.mission.state(), State::kDone);
  }
}

/// Control follows its plan also where the autopilot is not heard.
TEST(Mission, ATakeOffIsNotFlownBeforeTheAutopilotHasArmed) {
  Bench bench;
  bench.Run(0.2);
  ASSERT_TRUE(bench.Command(Event::kTakeoff).accepted);
  bench.mission.inputs().flying = true;
  bench.Run(5.0);
  bench.mission.inputs().disarmed = bench.t;
  bench.mission.inputs().on_ground = true;
  bench.Run(5.0);
  EXPECT_EQ(bench.mission.state(), State::kTakeoff);
  bench.mission.inputs().handed_over = true;
  bench.Run(5.0);
  EXPECT_EQ(bench.mission.state(), State::kReady) << "called off";
  bench.mission.inputs().disarmed.reset();
  bench.mission.inputs().armed = true;
  bench.Run(0.1);
  EXPECT_EQ(bench.mission.state(), State::kHold) << "found in flight";
  bench.Run(3.0);
  bench.mission.inputs().disarmed = bench.t;
  bench.Run(0.1);
  EXPECT_EQ(bench.mission.state(), State::kDone);
}

TEST(Mission, StartedAfterTheAutopilotsLandingItIsOverAsWell) {
  Bench bench;
  bench.mission.inputs().flying = true;
  bench.mission.inputs().on_ground = bench.mission.inputs().handed_over = true;
  for (int i = 0; i < 5; ++i) {
    bench.mission.inputs().disarmed = bench.t;
    bench.Run(1.0);
  }
  EXPECT_EQ(bench.mission.state(), State::kDone);
}

}  // namespace
}  // namespace chase::mission
