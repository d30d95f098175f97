#include <gtest/gtest.h>

#include "fcu_flight.h"
#include "services/fcu/bridge.h"

namespace chase::fcu::testing {
namespace {

using State = Handshake::State;

/// Does a failsafe come within 5 s, or is there one? No setpoint may end it. `of`: the case.
bool FailsForGood(Flight* flight, double of) {
  bool failed = flight->px4.failsafe();
  for (int i = 0; i < 2000; ++i) {
    flight->Run(0.0025);
    failed = failed || flight->px4.failsafe();
    EXPECT_FALSE(failed && flight->px4.mode() == kOffboardMode) << of;
    if (failed && flight->px4.mode() == kOffboardMode) break;
  }
  return failed;
}

TEST(FcuFailsafe, AFailsafeIsLatchedThoughTheStreamCouldComeBack) {
  StandInOptions options;
  options.com_of_loss_t = 0.3;  // shorter than our own patience
  Flight flight(options);
  flight.TakeOff(5.0);
  flight.setpoints = false;
  flight.Run(0.45);
  ASSERT_TRUE(flight.px4.failsafe());
  flight.Run(0.04);
  flight.setpoints = true;
  flight.Run(1.5);
  // Either a heartbeat told us and it is latched, or the stream was back before.
  const State state = flight.state();
  EXPECT_TRUE(state == State::kFailsafe || state == State::kFlying) << flight.bridge.Words();
  EXPECT_EQ(flight.px4.mode() == kOffboardMode, state == State::kFlying);
}

TEST(FcuFailsafe, LinkLossEndsInALatchedFailsafe) {
  Flight flight;
  flight.TakeOff(5.0);
  flight.link = false;
  const auto fails_safe = [&] { return flight.px4.failsafe(); };
  EXPECT_NEAR(Took(&flight, "link cut, the autopilot lands", 3.0, fails_safe), 1.0, 0.1);
  flight.Run(2.0);
  EXPECT_TRUE(flight.px4.failsafe());
  // Back, with setpoints that come all the time: a stream would bring OFFBOARD back by itself.
  flight.link = true;
  const int sent = flight.px4.seen().setpoints;
  flight.Run(10.0);
  EXPECT_EQ(flight.px4.seen().setpoints, sent);
  EXPECT_FALSE(flight.px4.mode() == kOffboardMode) << flight.bridge.Words();
  EXPECT_TRUE(flight.Says("the link was cut, or this bridge stood still"));
}

// COM_FAIL_ACT_T as PX4 has it: it holds, then lands; no stream ends either.
TEST(FcuFailsafe, AHoldBeforeTheLandingIsAFailsafeToo) {
  StandInOptions options;
  options.com_fail_act_t = 5.0;
  Flight flight(options);
  flight.TakeOff(5.0);
  flight.link = false;
  flight.Run(2.0);
  EXPECT_TRUE(flight.px4.mode() == mavlink::kHoldMode);
  flight.link = true;
  const int sent = flight.px4.seen().setpoints;
  flight.Run(3.0);
  EXPECT_TRUE(flight.px4.mode() == mavlink::kHoldMode) << flight.bridge.Words();
  flight.Run(3.0);
  EXPECT_TRUE(flight.px4.mode() == kLandMode) << flight.bridge.Words();
  flight.Run(10.0);
  EXPECT_FALSE(flight.px4.armed());
  EXPECT_EQ(flight.px4.seen().setpoints, sent);
}

// Either it never was in a failsafe, or no setpoint ended that.
TEST(FcuFailsafe, ACutOfAnyLengthIsBorneOrLatched) {
  for (int ms = 100; ms <= 1600; ms += 50) {
    Flight flight;
    flight.TakeOff(3.0 + 0.037 * ms / 50.0);  // anywhere between two heartbeats
    flight.link = false;
    flight.Run(1e-3 * ms);
    flight.link = true;
    const bool failed = FailsForGood(&flight, ms);
    EXPECT_EQ(failed, ms > 750) << ms << flight.bridge.Words();
    EXPECT_EQ(flight.state() == State::kFlying, !failed) << ms << flight.bridge.Words();
  }
}

// The same where the bridge itself stood still: what came in meanwhile is of before.
TEST(FcuFailsafe, ABridgeThatStoodStillDoesNotEndAFailsafe) {
  for (const double seconds : {0.3, 0.45, 0.6, 0.9, 1.2, 1.9}) {
    Flight flight;
    flight.TakeOff(5.0);
    flight.bridge_runs = false;
    flight.Run(seconds);
    flight.bridge_runs = true;
    EXPECT_EQ(FailsForGood(&flight, seconds), seconds > 0.75) << seconds << flight.bridge.Words();
  }
}

TEST(FcuFailsafe, ABridgeThatBeginsAnewDoesNotStreamIntoAFailsafe) {
  FcuConfig config;
  config.engage = "pilot";
  Flight flight({}, config);
  ASSERT_TRUE(flight.RunUntil(State::kStreaming, 12.0));
  flight.px4.PilotMode(kOffboardMode);
  flight.px4.PilotArms(true);
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 3.0));
  flight.Run(5.0);
  flight.link = false;
  flight.Run(1.5);
  ASSERT_TRUE(flight.px4.failsafe());
  flight.bridge = Bridge(config);
  flight.link = true;
  flight.Run(3.0);
  EXPECT_FALSE(flight.px4.mode() == kOffboardMode) << flight.bridge.Words();
  EXPECT_TRUE(flight.Says("in a failsafe"));
  flight.px4.PilotMode({3, 0});
  ASSERT_TRUE(flight.RunUntil(State::kStreaming, 3.0)) << "the pilot has ended it";
}

// It hears the last heartbeat of before long before it knows the clock; what came in between it
// cannot know.
TEST(FcuFailsafe, ABridgeThatBeganAnewTrustsNoHeartbeatOfBefore) {
  int borne = 0;
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    for (const bool pilot : {false, true}) {
      Flight flight({}, {}, seed);
      flight.TakeOff(3.0 + 0.09 * static_cast<double>(seed));
      flight.bridge = Bridge(FcuConfig{});
      flight.bridge_runs = false;
      flight.Run(0.05 * static_cast<double>(seed));
      flight.bridge_runs = true;
      ASSERT_TRUE(flight.RunUntil(State::kStandby, 1.5)) << flight.bridge.Words();
      flight.Run(0.01);
      if (pilot) flight.px4.PilotMode({3, 0});
      const int before = flight.px4.seen().setpoints_while_not_offboard;
      const bool failed = FailsForGood(&flight, static_cast<double>(seed));
      EXPECT_EQ(flight.px4.seen().setpoints_while_not_offboard, before) << seed << pilot;
      if (!pilot) {
        EXPECT_EQ(flight.state() == State::kFlying, !failed) << seed;
      }
      borne += !pilot && !failed;
    }
  }
  EXPECT_GE(borne, 5) << "restarts that the flight outlives";
}

TEST(FcuFailsafe, ACriticalBatteryLandsAndIsNoFlightAfterwards) {
  Flight flight;
  flight.TakeOff(5.0);
  flight.px4.SetCharge(0.06);
  Took(&flight, "battery critical, the autopilot lands and the bridge lets it", 3.0,
       State::kFailsafe);
  EXPECT_TRUE(flight.Says("Critical battery"));
  EXPECT_TRUE(flight.px4.mode() == kLandMode);
  flight.Run(12.0);
  EXPECT_FALSE(flight.px4.armed()) << "landed and disarmed, with the setpoints still coming";
  flight.setpoints = false;
  flight.Run(3.0);
  flight.setpoints = true;
  flight.Run(8.0);
  EXPECT_FALSE(flight.px4.armed()) << "arming is refused: " << flight.bridge.Words();
}

// Whoever starts a process that has died takes a quarter of a second; COM_OF_LOSS_T is a second.
TEST(FcuFailsafe, GoesOnWhereItBeganAnewInMidFlight) {
  for (int i = 0; i < 20; ++i) {
    Flight flight;
    flight.TakeOff(5.0 + 0.05 * i);  // anywhere between two heartbeats of its own accord
    flight.link = false;
    flight.bridge = Bridge(FcuConfig{});
    flight.bridge_runs = false;
    flight.Run(0.25);
    flight.link = flight.bridge_runs = true;
    flight.px4.TakeOutgoing();
    const auto streams = [&] { return flight.bridge.handshake().streams(); };
    EXPECT_LT(Took(&flight, "bridge killed and restarted, it streams", 2.0, streams), 0.4);
    flight.Run(30.0);
    EXPECT_EQ(flight.state(), State::kFlying) << flight.bridge.Words();
    EXPECT_EQ(flight.px4.seen().times_armed, 1);
  }
}

TEST(FcuFailsafe, AnAutopilotThatBeginsAnewIsAskedForItsStreamsAgain) {
  Flight flight;
  flight.setpoints = false;
  flight.Run(10.0);
  flight.px4.Reboot(flight.now());
  EXPECT_EQ(flight.px4.seen().rates.size(), 0u);
  flight.Run(10.0);
  EXPECT_GE(flight.px4.seen().rates.size(), 6u) << "all but RC_CHANNELS, which it lacks";
  EXPECT_EQ(flight.bridge.clock().restarts(), 1);
  EXPECT_EQ(flight.bridge.rates().missing(), "");
  flight.setpoints = true;
  EXPECT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.Run(3.0);
  flight.px4.Reboot(flight.now());
  flight.Run(2.0);
  // Whichever it says first: that it is disarmed, or that it stands on the ground.
  EXPECT_TRUE(flight.state() == State::kFailsafe || flight.state() == State::kDone)
      << flight.bridge.Words();
  flight.Run(10.0);
  EXPECT_EQ(flight.px4.seen().times_armed, 1) << "not armed again by itself";
}

TEST(FcuFailsafe, AnAutopilotWhoseClockGoesBackIsTakenUpAgainWithinASecond) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    Flight flight({}, {}, seed);
    flight.setpoints = false;
    flight.loss = 0.1;
    flight.Run(10.0 + 0.05 * static_cast<double>(seed));
    flight.px4.Reboot(flight.now());
    const std::size_t samples = flight.imu.size();
    const auto taken_up = [&] { return flight.imu.size() > samples + 20; };
    EXPECT_LT(Took(&flight, "a clock that goes back, until its IMU is stamped", 2.0, taken_up),
              1.0);
    EXPECT_EQ(flight.bridge.clock().restarts(), 1);
    EXPECT_NEAR(static_cast<double>(flight.imu.back().utime - flight.now()), 0.0, 10'000.0);
  }
}

// Whatever is lost on the way: it flies, and it ends.
TEST(FcuFailsafe, FliesAndEndsOnALossyLink) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    StandInOptions options;
    options.lost_acks = 0.5;
    Flight flight(options, {}, seed);
    flight.loss = 0.2;
    ASSERT_TRUE(flight.RunUntil(State::kFlying, 30.0)) << seed << flight.bridge.Words();
    flight.Run(5.0);
    EXPECT_EQ(flight.state(), State::kFlying) << seed << flight.bridge.Words();
    flight.setpoints = false;
    ASSERT_TRUE(flight.RunUntil(State::kDone, 40.0)) << seed << flight.bridge.Words();
    EXPECT_FALSE(flight.px4.armed());
  }
}

}  // namespace
}  // namespace chase::fcu::testing
