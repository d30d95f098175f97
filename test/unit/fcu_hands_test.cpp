#include <gtest/gtest.h>

#include "common/bus/autopilot_state.h"
#include "fcu_flight.h"
#include "services/fcu/bridge.h"

namespace chase::fcu::testing {
namespace {

using State = Handshake::State;

// PX4 refuses a plain disarming in the air.
TEST(FcuHands, OnlyAKillCutsTheMotorsInTheAir) {
  Flight flight;
  flight.TakeOff(5.0);
  flight.motors = false;
  flight.Run(0.5);
  EXPECT_EQ(flight.state(), State::kLanding) << flight.bridge.Words();
  EXPECT_TRUE(flight.px4.armed());
  ASSERT_GT(flight.px4.p_WB().z(), 0.5);
  flight.bridge.Kill();
  flight.Run(0.1);
  EXPECT_FALSE(flight.px4.armed());
  EXPECT_TRUE(flight.RunUntil(State::kDone, 1.5)) << flight.bridge.Words();
  EXPECT_TRUE(flight.Says("killed by command"));
}

TEST(FcuHands, AKillIsSentUntilItIsObeyed) {
  StandInOptions options;
  options.lost_acks = 1.0;
  Flight flight(options);
  flight.TakeOff(5.0);
  flight.link = false;
  flight.bridge.Kill();
  flight.Run(0.7);
  EXPECT_TRUE(flight.px4.armed());
  flight.link = true;
  flight.Run(0.7);
  EXPECT_FALSE(flight.px4.armed());
}

TEST(FcuHands, AKillIsNotForAPilotWhoHasItNorForTheFlightToCome) {
  Flight flight;
  flight.setpoints = false;
  flight.Run(3.0);
  flight.bridge.Kill();
  flight.setpoints = true;
  flight.TakeOff(5.0);
  flight.px4.PilotMode({3, 0});
  ASSERT_TRUE(flight.RunUntil(State::kPilot, 2.0));
  flight.bridge.Kill();
  flight.Run(3.0);
  EXPECT_TRUE(flight.px4.armed());
}

// He took it from a failsafe a moment ago.
TEST(FcuHands, AKillIsNotForAPilotWhoHasJustTakenIt) {
  for (int i = 0; i < 10; ++i) {
    Flight flight;
    flight.TakeOff(5.0 + 0.1 * i);
    flight.px4.SetCharge(0.04);
    ASSERT_TRUE(flight.RunUntil(State::kFailsafe, 2.0));
    flight.Run(0.5);
    flight.px4.PilotMode({3, 0});
    flight.Run(0.2);
    flight.bridge.Kill();
    flight.Run(1.0);
    EXPECT_TRUE(flight.px4.armed()) << flight.bridge.Words();
  }
}

TEST(FcuHands, AKillIsNotForAPilotOnALowBattery) {
  Flight flight;
  flight.TakeOff(5.0);
  flight.px4.SetCharge(0.1);
  flight.Run(2.0);
  ASSERT_TRUE(flight.px4.failsafe()) << "a warning, which PX4 calls critical";
  EXPECT_EQ(flight.state(), State::kFlying) << flight.bridge.Words();
  flight.px4.PilotMode({3, 0});
  flight.Run(1.1);
  EXPECT_EQ(flight.state(), State::kPilot) << flight.bridge.Words();
  flight.bridge.Kill();
  flight.Run(3.0);
  EXPECT_TRUE(flight.px4.armed());
  EXPECT_TRUE(flight.px4.mode() == (Mode{3, 0}));
}

TEST(FcuHands, ThePilotTakesItAtOnceAndForGood) {
  Flight flight;
  flight.TakeOff(5.0);
  flight.px4.PilotMode({3, 0});
  Took(&flight, "the pilot takes over, no stream any more", 0.2, State::kPilot);
  const auto before = flight.px4.seen();
  flight.Run(20.0);
  EXPECT_EQ(flight.px4.seen().setpoints, before.setpoints);
  EXPECT_EQ(flight.px4.seen().offboard_commands, before.offboard_commands);
  EXPECT_EQ(flight.state(), State::kPilot) << "setpoints still come";
  flight.setpoints = false;
  flight.Run(5.0);
  EXPECT_EQ(flight.state(), State::kPilot) << "still armed";
  flight.px4.PilotArms(false);
  EXPECT_TRUE(flight.RunUntil(State::kStandby, 5.0));
  flight.px4.PilotMode({3, 0});
  flight.setpoints = true;
  EXPECT_TRUE(flight.RunUntil(State::kFlying, 12.0)) << "another flight";
}

// He may take it from a landing, too. The heartbeat of its own accord comes once a second.
TEST(FcuHands, IsToldWithinAMomentWhoFlies) {
  for (const bool lands : {false, true}) {
    for (int i = 0; i < 10; ++i) {
      Flight flight;
      flight.TakeOff(5.0 + 0.1 * i);
      if (lands) {
        flight.motors = false;
        flight.Run(1.0, [&] { return flight.px4.mode() == kLandMode; });
        flight.Run(0.5);
        ASSERT_EQ(flight.state(), State::kLanding);
      }
      flight.px4.PilotMode({3, 0});
      EXPECT_TRUE(flight.RunUntil(State::kPilot, 0.2)) << flight.bridge.Words();
      const int beats = flight.heartbeats;
      flight.Run(10.0);
      EXPECT_NEAR(flight.heartbeats - beats, 10, 1) << "no more than it needs";
    }
  }
}

TEST(FcuHands, TheSticksTakeItAndALostTransmitterLands) {
  StandInOptions options;
  options.transmitter = true;
  Flight sticks(options);
  sticks.TakeOff(3.0);
  EXPECT_TRUE(sticks.Says("receiver heard"));
  sticks.px4.PilotSticks(0.2);
  sticks.Run(1.5);
  EXPECT_EQ(sticks.state(), State::kFlying) << "not far enough";
  sticks.px4.PilotSticks(0.6);
  EXPECT_TRUE(sticks.RunUntil(State::kPilot, 1.1)) << sticks.bridge.Words();
  const int sent = sticks.px4.seen().setpoints;
  sticks.Run(10.0);
  EXPECT_EQ(sticks.px4.seen().setpoints, sent);
  EXPECT_TRUE(sticks.px4.mode() == (Mode{3, 0}));

  Flight lost(options);
  lost.TakeOff(3.0);
  lost.px4.options().transmitter = false;
  EXPECT_TRUE(lost.RunUntil(State::kFailsafe, 2.0)) << lost.bridge.Words();
  EXPECT_TRUE(lost.Says("Manual control lost"));
  lost.Run(10.0);
  EXPECT_FALSE(lost.px4.armed()) << "landed, though setpoints come";
}

TEST(FcuHands, TheSticksTakeItFromALandingOfOursButNotFromAFailsafe) {
  StandInOptions options;
  options.transmitter = true;
  Flight landing(options);
  landing.TakeOff(5.0);
  landing.setpoints = false;
  ASSERT_TRUE(landing.RunUntil(State::kLanding, 2.0)) << landing.bridge.Words();
  landing.Run(0.3);
  ASSERT_TRUE(landing.px4.mode() == kLandMode);
  landing.px4.PilotSticks(0.6);
  EXPECT_TRUE(landing.RunUntil(State::kPilot, 0.2)) << landing.bridge.Words();
  landing.Run(5.0);
  EXPECT_TRUE(landing.px4.mode() == (Mode{3, 0}));

  Flight drained(options);
  drained.TakeOff(5.0);
  drained.px4.SetCharge(0.04);
  ASSERT_TRUE(drained.RunUntil(State::kFailsafe, 2.0));
  drained.px4.PilotSticks(0.6);
  drained.Run(0.3);
  EXPECT_TRUE(drained.px4.mode() == kLandMode) << "the mode switch alone does";
}

// A heartbeat is up to a second old: AUTO.LAND would take it from him.
TEST(FcuHands, ALandingIsNotAskedOfAPilotWhoHasJustTakenIt) {
  for (const double before : {0.02, 0.3, 0.8}) {
    Flight flight;
    flight.TakeOff(5.0);
    const int beats = flight.heartbeats;
    flight.Run(1.5, [&] { return flight.heartbeats > beats; });
    flight.px4.PilotMode({3, 0});
    flight.Run(before);
    flight.motors = false;
    flight.Run(5.0);
    EXPECT_TRUE(flight.px4.mode() == (Mode{3, 0})) << before;
    EXPECT_EQ(flight.state(), State::kPilot) << flight.bridge.Words();
  }
}

// The mode stays OFFBOARD, and the motors would start again with the switch.
TEST(FcuHands, TheKillSwitchTakesItForGood) {
  for (const bool lands : {false, true}) {
    Flight flight;
    flight.TakeOff(5.0);
    if (lands) {
      flight.motors = false;
      ASSERT_TRUE(flight.RunUntil(State::kLanding, 1.0)) << flight.bridge.Words();
      flight.Run(0.3);
    }
    flight.px4.PilotKills(true);
    Took(&flight, "kill switch, no stream any more", 0.2, State::kFailsafe);
    EXPECT_EQ(flight.px4.mode() == kOffboardMode, !lands);
    EXPECT_TRUE(flight.Says("kill switch"));
    const int sent = flight.px4.seen().setpoints;
    flight.Run(0.5);
    EXPECT_TRUE(flight.px4.armed());
    flight.px4.PilotKills(false);
    flight.motors = true;
    flight.Run(10.0);
    EXPECT_EQ(flight.px4.seen().setpoints, sent);
    EXPECT_EQ(flight.state(), State::kFailsafe) << flight.bridge.Words();
  }
}

TEST(FcuHands, ThePilotMayBeTheOneWhoEngages) {
  FcuConfig config;
  config.engage = "pilot";
  Flight flight({}, config);
  ASSERT_TRUE(flight.RunUntil(State::kStreaming, 12.0));
  flight.Run(10.0);
  EXPECT_EQ(flight.state(), State::kStreaming);
  EXPECT_EQ(flight.px4.seen().offboard_commands, 0);
  flight.px4.PilotMode(kOffboardMode);
  flight.px4.PilotArms(true);
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 3.0));
  flight.px4.PilotMode({3, 0});
  ASSERT_TRUE(flight.RunUntil(State::kStreaming, 3.0)) << "he may give it back";
  flight.px4.PilotMode(kOffboardMode);
  EXPECT_TRUE(flight.RunUntil(State::kFlying, 3.0));
}

TEST(FcuHands, APilotInTheAirIsNotInterfered) {
  Flight flight;
  flight.px4.PilotLifts(2.0);
  flight.Run(15.0);
  EXPECT_NEAR(flight.px4.p_WB().z(), 2.0, 0.1);
  EXPECT_EQ(flight.px4.seen().setpoints, 0);
  EXPECT_EQ(flight.px4.seen().offboard_commands, 0);
}

// He has COM_DISARM_PRFLT to take off.
TEST(FcuHands, NorIsAPilotWhoHasArmedOnTheGround) {
  Flight flight;
  flight.px4.PilotArms(true);
  flight.Run(9.5);
  EXPECT_TRUE(flight.px4.armed());
  EXPECT_EQ(flight.px4.seen().setpoints, 0);
  EXPECT_EQ(flight.px4.seen().offboard_commands, 0);
  flight.Run(1.0);
  EXPECT_FALSE(flight.px4.armed());
}

TEST(FcuHands, ItsWordsTellWhoFliesAndWhereItStands) {
  Flight flight;
  bus::AutopilotState state;
  const auto hear = [&] {
    status_t m{};
    m.utime = flight.now();
    m.name = "fcu";
    m.detail = flight.bridge.Words();
    state.Hear(m);
    return std::pair(state.Obeys(flight.now()), state.IsOnGround());
  };
  EXPECT_EQ(hear(), std::pair(true, false)) << "nobody has told anything";
  ASSERT_TRUE(flight.RunUntil(State::kArming, 12.0));
  EXPECT_EQ(hear(), std::pair(false, true));
  EXPECT_FALSE(state.Obeys(flight.now() + 30'000'000)) << "it stood there when it fell silent";
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  EXPECT_TRUE(hear().first);
  flight.Run(5.0);
  EXPECT_EQ(hear(), std::pair(true, false));
  flight.px4.PilotMode({3, 0});
  flight.Run(1.5);
  EXPECT_EQ(hear(), std::pair(false, false));
  EXPECT_TRUE(state.Obeys(flight.now() + 3'000'000)) << "not known any more";
  flight.link = false;
  flight.Run(5.0);
  EXPECT_EQ(hear(), std::pair(false, false)) << "the autopilot is silent";
}

}  // namespace
}  // namespace chase::fcu::testing
