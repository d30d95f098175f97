#include <gtest/gtest.h>

#include "fcu_engaged.h"

namespace chase::fcu::testing {
namespace {

using State = Handshake::State;

TEST(FcuHandshake, AFlightThatIsOverIsNotGoneOnWith) {
  Engaged flight(true);
  flight.LosesControl();
  flight.facts.mode = kLandMode;
  flight.Run(2.0);
  flight.facts.armed = false;
  flight.facts.on_ground = true;
  flight.facts.asked = false;  // mission still says that it chases
  flight.Run(3.0);
  flight.facts.wish = true;  // control is back
  flight.Run(20.0);
  EXPECT_EQ(flight.handshake.state(), State::kStandby);
  flight.facts.asked = true;
  flight.Run(0.1);
  EXPECT_EQ(flight.handshake.state(), State::kStreaming) << "another flight";
}

TEST(FcuHandshake, APilotMayTakeItFromALandingThatIsCalledCritical) {
  Engaged flight(true);
  flight.LosesControl();
  flight.facts.mode = kLandMode;
  flight.facts.failsafe = true;  // low battery, say
  flight.Run(2.0);
  ASSERT_EQ(flight.handshake.state(), State::kLanding);
  flight.facts.mode = {2, 0};  // ALTCTL
  for (int i = 0; i < 50; ++i) {
    flight.Run(0.1);
    EXPECT_FALSE(flight.handshake.NextCommand(flight.facts.utime));
  }
  EXPECT_EQ(flight.handshake.state(), State::kPilot);
}

TEST(FcuHandshake, APilotMayTakeItFromALandingAtAnyMoment) {
  for (const double after : {0.05, 0.3, 0.9, 1.7, 2.4}) {
    for (const bool heard : {false, true}) {
      Engaged flight(true);
      flight.LosesControl();
      flight.Run(0.01);
      ASSERT_TRUE(flight.handshake.NextCommand(flight.facts.utime));
      flight.handshake.OnAck(21, 0, flight.facts.utime);
      if (heard) flight.facts.mode = kLandMode;
      int asked = 0;
      for (int i = 0; i < static_cast<int>(after * 100); ++i) {
        flight.Run(0.01);
        asked += flight.handshake.NextCommand(flight.facts.utime).has_value();
      }
      if (heard) {
        EXPECT_EQ(asked, 0) << after;
      }
      flight.facts.mode = kPosition;
      flight.Run(0.01);
      EXPECT_EQ(flight.handshake.state(), State::kPilot) << after;
      EXPECT_FALSE(flight.handshake.NextCommand(flight.facts.utime + 5'000'000));
    }
  }
}

TEST(FcuHandshake, AKillMeetsAnArmingThatIsOnItsWay) {
  Engaged arming(false);
  arming.handshake.Kill();
  arming.Run(0.5);
  EXPECT_EQ(arming.handshake.state(), State::kKilling);
  arming.facts.armed = true;
  for (int i = 0; i < 300; ++i) {
    arming.Run(0.01);
    if (const auto m = arming.handshake.NextCommand(arming.facts.utime); m && m->param2 > 0.0f)
      arming.facts.armed = false;
  }
  EXPECT_EQ(arming.handshake.state(), State::kDone);
}

// A process that began anew did not see whose flight it was; a failsafe is no pilot.
TEST(FcuHandshake, AKillReachesAFailsafeThatIsFoundButNoPilot) {
  struct Case {
    Mode mode;
    bool failsafe, killed;
  };
  for (const bool engages : {true, false}) {
    for (const Case& c : {Case{kLandMode, true, true}, Case{{4, 5}, true, true},
                          Case{kPosition, true, false}, Case{kLandMode, false, false}}) {
      Handshake handshake(engages, kGiveUp);
      Facts facts = Heard(c.mode);
      facts.armed = facts.wish = true;
      facts.missing = c.failsafe ? "the autopilot is in a failsafe" : "";
      facts.failsafe = c.failsafe;
      for (int i = 0; i < 200; ++i, facts.utime += kTick) handshake.Update(facts);
      if (engages) {
        EXPECT_EQ(handshake.state(), c.killed ? State::kFailsafe : State::kPilot);
      }
      handshake.Kill();
      EXPECT_EQ(handshake.state() == State::kKilling, c.killed) << handshake.reason();
      EXPECT_EQ(handshake.NextCommand(facts.utime).has_value(), c.killed);
    }
  }
}

TEST(FcuHandshake, AKillIsNotForAPilotWhoTookItFromAFailsafe) {
  Engaged flight(true);
  flight.facts.failsafe = true;
  flight.facts.mode = kLandMode;
  flight.Run(0.1);
  ASSERT_EQ(flight.handshake.state(), State::kFailsafe);
  flight.facts.failsafe = false;
  flight.facts.mode = kPosition;
  flight.Run(0.1);
  flight.handshake.Kill();
  EXPECT_EQ(flight.handshake.state(), State::kFailsafe);
}

constexpr Mode kByStick[] = {{1, 0}, {2, 0}, {3, 0}, {5, 0}, {7, 0}};

// PX4 1.14 calls a low battery critical, and a pilot who has taken over from a failsafe as well.
TEST(FcuHandshake, APilotWinsOverWhatIsCalledCritical) {
  for (const Mode mode : kByStick) {
    for (const bool failed_before : {false, true}) {
      Engaged flight(true);
      flight.facts.failsafe = true;
      if (failed_before) flight.facts.mode = kLandMode;
      flight.Run(0.1);
      flight.facts.mode = mode;
      flight.Run(0.1);
      flight.handshake.Kill();
      EXPECT_EQ(flight.handshake.state(), failed_before ? State::kFailsafe : State::kPilot);
      for (int i = 0; i < 100; ++i) {
        flight.Run(0.1);
        EXPECT_FALSE(flight.handshake.NextCommand(flight.facts.utime)) << mode.name();
        EXPECT_FALSE(flight.handshake.streams());
      }
    }
  }
}

TEST(FcuHandshake, NothingThatWasAskedBeforeIsAskedOfAPilot) {
  for (const Mode mode : kByStick) {
    Engaged killed(true);
    killed.handshake.Kill();
    Engaged landed(true);
    landed.facts.motors_off = landed.facts.on_ground = true;
    landed.facts.wish = false;
    landed.Run(0.02);
    Engaged late(false);
    late.facts.wish = false;
    late.Run(0.02);
    late.facts.on_ground = true;
    EXPECT_EQ(killed.handshake.state(), State::kKilling);
    EXPECT_EQ(landed.handshake.state(), State::kDisarming);
    EXPECT_EQ(late.handshake.state(), State::kStandby);
    for (Engaged* flight : {&killed, &landed, &late}) {
      flight->facts.armed = true;
      flight->facts.mode = mode;
      flight->Run(0.02);
      EXPECT_EQ(flight->handshake.state(), State::kPilot) << mode.name();
      EXPECT_FALSE(flight->handshake.NextCommand(flight->facts.utime + 5'000'000));
    }
  }
}

TEST(FcuHandshake, AnArmingThatComesTooLateIsTakenBack) {
  Engaged arming(false);
  arming.facts.wish = false;
  arming.Run(0.01);
  ASSERT_EQ(arming.handshake.state(), State::kStandby);
  arming.facts.armed = true;
  arming.Run(0.01);
  EXPECT_EQ(arming.handshake.state(), State::kDisarming);
  const auto command = arming.handshake.NextCommand(arming.facts.utime);
  ASSERT_TRUE(command);
  EXPECT_EQ(command->command, 400);
  EXPECT_EQ(command->param1, 0.0f);
}

}  // namespace
}  // namespace chase::fcu::testing
