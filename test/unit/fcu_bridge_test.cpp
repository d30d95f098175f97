#include <gtest/gtest.h>

#include "fcu_flight.h"
#include "services/fcu/bridge.h"

namespace chase::fcu::testing {
namespace {

using State = Handshake::State;

TEST(FcuBridge, TakesOffHoversLandsAndDisarms) {
  Flight flight;
  flight.TakeOff(10.0);
  EXPECT_NEAR(flight.px4.p_WB().z(), 1.5, 0.1);
  EXPECT_TRUE(flight.Says("armed, in air"));
  flight.height = -1.0;  // onto the ground and pushed down
  flight.Run(8.0, [&] { return flight.px4.p_WB().z() <= 0.0; });
  flight.Run(0.5);
  flight.motors = false;
  ASSERT_TRUE(flight.RunUntil(State::kDone, 8.0)) << flight.bridge.Words();
  EXPECT_FALSE(flight.px4.armed());
  const std::vector<std::string> expected = {"no autopilot",        "standby",   "streaming",
                                             "asking for OFFBOARD", "arming",    "flying",
                                             "touchdown",           "disarming", "done"};
  EXPECT_EQ(flight.states, expected);
  EXPECT_EQ(flight.px4.seen().times_armed, 1);
}

// Heartbeats come once a second, the mode and the arming would be known by them.
TEST(FcuBridge, EngagesWithinAMomentOfTheStream) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    Flight flight({}, {}, seed);
    flight.setpoints = false;
    flight.Run(7.0 + 0.2 * static_cast<double>(seed));
    flight.setpoints = true;
    EXPECT_LT(Took(&flight, "from the first setpoint to flight", 5.0, State::kFlying), 1.6);
  }
}

TEST(FcuBridge, SendsItsStreamsAtTheirRates) {
  Flight flight;
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  const auto before = flight.px4.seen();
  flight.Run(10.0);
  const auto& after = flight.px4.seen();
  EXPECT_NEAR(after.setpoints - before.setpoints, 1000, 10);
  EXPECT_NEAR(after.odometry - before.odometry, 400, 8);
  EXPECT_NEAR(after.heartbeats - before.heartbeats, 10, 1);
  EXPECT_EQ(after.setpoint->type_mask, 3);
  EXPECT_NEAR(after.rates.at(mav::HighresImu::kId), 200.0, 1.0);
  EXPECT_EQ(flight.bridge.rates().missing(), "");
}

TEST(FcuBridge, BothSidesKnowTheLongestGapOfTheStream) {
  Flight flight;
  flight.TakeOff(10.0);
  const auto said = [&](const char* gap) {
    return flight.bridge.Words().find(std::string("at most ") + gap + " ms apart") !=
           std::string::npos;
  };
  EXPECT_TRUE(said("10")) << flight.bridge.Words();
  EXPECT_LT(flight.px4.seen().longest_setpoint_gap, 0.012);
  flight.setpoints = false;  // for longer than setpoint_age
  flight.Run(0.3);
  flight.setpoints = true;
  flight.Run(1.0);
  ASSERT_EQ(flight.state(), State::kFlying);
  EXPECT_NEAR(flight.px4.seen().longest_setpoint_gap, 0.2, 0.06) << flight.bridge.Words();
  EXPECT_FALSE(said("10")) << flight.bridge.Words();
}

/// Of the autopilot about a stamp of ours that is 0.1 s old, us.
double ClockError(const Flight& flight) {
  const int64_t stamp = flight.now() - 100'000;
  const auto host = flight.px4.HostTime(static_cast<uint64_t>(stamp));
  EXPECT_TRUE(host);
  return static_cast<double>(host.value_or(0) - stamp);
}

// Until then a pose would count as measured when it arrives.
TEST(FcuBridge, NoFlightBeginsBeforeTheAutopilotKnowsOurClock) {
  Flight flight;
  flight.Run(3.0);
  EXPECT_EQ(flight.state(), State::kStandby);
  EXPECT_TRUE(Holds(flight.bridge.missing(), "learns our clock"));
  ASSERT_TRUE(flight.RunUntil(State::kStreaming, 4.0)) << flight.bridge.missing();
  flight.Run(0.1);  // the last answers are on their way
  EXPECT_LT(std::abs(ClockError(flight)), 2000.0);
}

// It counts what reaches it, and leaves out what takes longer than 10 ms there and back.
TEST(FcuBridge, NorWhereAnswersToItAreLost) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    Flight flight({}, {}, seed);
    flight.loss = 0.3;
    ASSERT_TRUE(flight.RunUntil(State::kStreaming, 30.0)) << flight.bridge.missing();
    EXPECT_LT(std::abs(ClockError(flight)), 5000.0) << seed;
  }
}

TEST(FcuBridge, NorWhereTheyTakeTooLong) {
  Flight flight;
  flight.delay = 6'000;
  flight.Run(20.0);
  EXPECT_EQ(flight.state(), State::kStandby);
  EXPECT_TRUE(Holds(flight.bridge.missing(), "learns our clock: 0 of 500"));
}

TEST(FcuBridge, NorWhereThePilotHasArmedOnTheGround) {
  FcuConfig config;
  config.engage = "pilot";
  Flight flight({}, config);
  flight.px4.PilotArms(true);
  flight.Run(3.0);
  EXPECT_EQ(flight.px4.seen().setpoints, 0);
  EXPECT_TRUE(Holds(flight.bridge.missing(), "learns our clock"));
  EXPECT_TRUE(flight.RunUntil(State::kStreaming, 4.0)) << flight.bridge.missing();
}

TEST(FcuBridge, ClocksMeetOnBothSides) {
  Flight flight;
  flight.setpoints = false;
  flight.Run(20.0);
  const auto& clock = flight.bridge.clock();
  ASSERT_TRUE(clock.synced());
  const int64_t host = flight.now();
  EXPECT_NEAR(static_cast<double>(*clock.HostTime(flight.px4.Clock(host)) - host), 0.0, 1500.0);
  const auto& errors = flight.px4.seen().clock_errors;
  ASSERT_GT(errors.size(), 100u);
  double mean = 0;
  for (double e : errors) mean += e / static_cast<double>(errors.size());
  EXPECT_NEAR(mean, 0.0, 1.5e-3) << "ticks of 2.5 ms are the stand-in's own resolution";
}

TEST(FcuBridge, ImuIsAt200HzOnTheHostsClock) {
  Flight flight;
  flight.setpoints = false;
  flight.Run(8.0);
  const std::size_t begin = flight.imu.size();
  const int64_t from = flight.now();
  flight.Run(5.0);
  EXPECT_NEAR(static_cast<double>(flight.imu.size() - begin), 1000.0, 10.0);
  EXPECT_NEAR(static_cast<double>(flight.imu[begin].utime - from), 0.0, 10'000.0);
  for (std::size_t i = begin; i < flight.imu.size(); ++i) {
    EXPECT_GT(flight.imu[i].utime, flight.imu[i - 1].utime);
    EXPECT_NEAR(flight.imu[i].accel.z(), 9.81, 1e-3);
  }
  EXPECT_STREQ(flight.bridge.imu().source(), "HIGHRES_IMU");
}

TEST(FcuBridge, NeverSendsAStaleSetpoint) {
  Flight flight;
  flight.TakeOff(5.0);
  flight.setpoints = false;
  flight.Run(0.12);
  const int sent = flight.px4.seen().setpoints;
  EXPECT_LT(Took(&flight, "setpoints silent for 0.12 s, it lands", 1.0, State::kLanding), 0.5);
  flight.Run(0.5);
  EXPECT_EQ(flight.px4.seen().setpoints, sent);
  EXPECT_FALSE(flight.px4.failsafe()) << "we asked before the autopilot had to";
  EXPECT_TRUE(flight.px4.mode() == kLandMode);
  EXPECT_TRUE(flight.RunUntil(State::kDone, 20.0));
}

TEST(FcuBridge, ArmsAnewOnlyWhenMissionTakesOffAnew) {
  Flight flight;
  flight.bridge.OnFlightState(true, true);
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.bridge.OnFlightState(false, true);
  flight.Run(5.0);
  flight.setpoints = false;  // control hangs
  ASSERT_TRUE(flight.RunUntil(State::kStandby, 30.0)) << flight.bridge.Words();
  flight.setpoints = true;
  flight.bridge.OnFlightState(false, true);
  flight.Run(20.0);
  EXPECT_FALSE(flight.px4.armed());
  flight.bridge.OnFlightState(true, true);
  EXPECT_TRUE(flight.RunUntil(State::kFlying, 12.0)) << flight.bridge.Words();
}

// Control's motors run on, of a flight that was called off (READY) or stopped (HOLD) on the ground.
TEST(FcuBridge, BeginsNothingThatMissionDoesNotWantAnyMore) {
  for (const bool called_off : {true, false}) {
    for (const State at : {State::kStandby, State::kStreaming, State::kArming}) {
      Flight flight;
      flight.px4.options().preflight = "compass";
      flight.bridge.OnFlightState(true, true);
      ASSERT_TRUE(flight.RunUntil(at, 12.0)) << Handshake::Name(at);
      flight.bridge.OnFlightState(called_off, false);
      flight.Run(0.1);
      flight.px4.options().preflight.clear();
      flight.Run(20.0);
      EXPECT_EQ(flight.state(), State::kStandby) << Handshake::Name(at);
      EXPECT_FALSE(flight.px4.armed()) << Handshake::Name(at);
      flight.bridge.OnFlightState(false, true);
      EXPECT_TRUE(flight.RunUntil(State::kFlying, 12.0)) << flight.bridge.Words();
    }
  }
}

TEST(FcuBridge, TakesAnArmingBackThatComesThroughAfterTheFlightWasCalledOff) {
  Flight flight;
  flight.idle = true;
  flight.px4.options().preflight = "compass";
  flight.bridge.OnFlightState(true, true);
  ASSERT_TRUE(flight.RunUntil(State::kArming, 12.0));
  flight.bridge.OnFlightState(true, false);
  flight.px4.options().preflight.clear();  // before the request has come there
  flight.Run(0.2);
  EXPECT_TRUE(flight.px4.armed());
  flight.Run(2.0);
  EXPECT_FALSE(flight.px4.armed()) << flight.bridge.Words();
}

// A process that begins anew hears of a hold, or of nothing: whom it flew it flies on.
TEST(FcuBridge, WhatFliesGoesOnWhateverMissionWants) {
  Flight flight;
  flight.bridge.OnFlightState(true, true);
  flight.TakeOff(3.0);
  flight.bridge = Bridge(FcuConfig{});
  flight.bridge.OnFlightState(false, false);
  EXPECT_TRUE(flight.RunUntil(State::kFlying, 3.0)) << flight.bridge.Words();
  flight.Run(3.0);
  EXPECT_EQ(flight.state(), State::kFlying);
  EXPECT_TRUE(flight.px4.armed());
}

TEST(FcuBridge, ARepeatedSetpointIsNoFreshOne) {
  Flight flight;
  flight.TakeOff(3.0);
  flight.setpoints = false;
  const int64_t stuck = flight.now();
  for (int i = 0; i < 400; ++i) {
    flight.bridge.OnSetpoint(Hover(), stuck, flight.now());
    flight.Run(0.0025);
  }
  EXPECT_EQ(flight.state(), State::kLanding);
}

// A stalled process finds them one after another, each as if it had just come.
TEST(FcuBridge, ASetpointThatWaitedInAQueueIsNotSent) {
  Flight flight;
  flight.TakeOff(3.0);
  flight.setpoints = false;
  flight.Run(0.3);
  const int sent = flight.px4.seen().setpoints;
  for (int i = 0; i < 20; ++i) {
    flight.bridge.OnSetpoint(Hover(), flight.now() - 250'000, flight.now());
    flight.Run(0.005);
  }
  EXPECT_EQ(flight.px4.seen().setpoints, sent);
  flight.bridge.OnSetpoint(Hover(), flight.now() - 50'000, flight.now());
  flight.Run(0.005);
  EXPECT_EQ(flight.px4.seen().setpoints, sent + 1);
}

// The autopilot's own attitude is the better one then.
TEST(FcuBridge, ClosesNoAttitudeLoopOnAPoseThatIsOldOrBad) {
  FcuConfig config;
  config.body_rates = true;
  Flight flight({}, config);
  flight.TakeOff(3.0);
  const auto mask = [&] { return flight.px4.seen().setpoint->type_mask; };
  EXPECT_EQ(mask(), 128) << "rates";
  flight.poses = false;
  flight.Run(0.04);
  EXPECT_EQ(mask(), 128);
  flight.Run(0.03);
  EXPECT_EQ(mask(), 3) << "the attitude";
  flight.Run(0.5);
  EXPECT_EQ(mask(), 3);
  flight.poses = true;
  flight.Run(0.02);
  EXPECT_EQ(mask(), 128);
  flight.usable = false;
  flight.Run(0.02);
  EXPECT_EQ(mask(), 3);
  EXPECT_EQ(flight.state(), State::kFlying);
}

TEST(FcuBridge, LandsWhenThePoseHasBeenSilentForTooLong) {
  Flight flight;
  flight.TakeOff(5.0);
  flight.poses = false;
  flight.Run(0.3);
  const int odometry = flight.px4.seen().odometry;
  flight.Run(1.5);
  EXPECT_EQ(flight.state(), State::kFlying) << "control has its two seconds";
  Took(&flight, "estimate stale for 1.8 s, it lands", 0.5, State::kLanding);
  EXPECT_EQ(flight.px4.seen().odometry, odometry);
}

TEST(FcuBridge, BeginsNothingWithoutAPose) {
  Flight flight;
  flight.poses = false;
  flight.Run(10.0);
  EXPECT_EQ(flight.state(), State::kStandby);
  EXPECT_EQ(flight.bridge.missing(), "no POSE yet");
  EXPECT_EQ(flight.px4.seen().setpoints, 0);
  EXPECT_EQ(flight.px4.seen().offboard_commands, 0);
}

TEST(FcuBridge, BeginsNothingWhenTheAttitudesDiffer) {
  Flight flight;
  flight.poses = false;
  for (int i = 0; i < 4000; ++i) {
    Pose pose;
    pose.utime = flight.now();
    pose.R_WB = math::FromYaw(0.5);
    pose.usable = true;
    flight.bridge.OnPose(pose, flight.now());
    flight.Run(0.0025);
  }
  EXPECT_TRUE(Holds(flight.bridge.missing(), "29 degrees off"));
  EXPECT_EQ(flight.px4.seen().times_armed, 0);
}

TEST(FcuBridge, RefusalsAreSaidInWordsAndGivenUp) {
  StandInOptions refuses;
  refuses.refuses_offboard = true;
  Flight a(refuses);
  ASSERT_TRUE(a.RunUntil(State::kRefused, 12.0));
  EXPECT_TRUE(a.Says("OFFBOARD was refused (denied)"));
  const int sent = a.px4.seen().setpoints;
  a.Run(5.0);
  EXPECT_EQ(a.px4.seen().setpoints, sent) << "given up: no stream any more";
  EXPECT_EQ(a.px4.seen().offboard_commands, 1);

  StandInOptions stays;
  stays.refuses_to_arm = true;
  Flight c(stays);
  ASSERT_TRUE(c.RunUntil(State::kRefused, 12.0));
  EXPECT_TRUE(c.Says("refused: arming was refused (denied)"));

  StandInOptions preflight;
  preflight.preflight = "ekf2 missing data and a sentence of more than fifty bytes";
  FcuConfig config;
  config.give_up_after = 8.0;
  Flight b(preflight, config);
  Took(&b, "arming refused for 8 s and given up, from the start", 25.0, State::kRefused);
  EXPECT_NE(
      b.bridge.Words().find("arming did not come (not now): Arming denied: Resolve system health "
                            "failures first, Preflight Fail: " +
                            preflight.preflight),
      std::string::npos)
      << b.bridge.Words();
  b.px4.options().preflight.clear();
  b.Run(5.0);
  EXPECT_EQ(b.state(), State::kRefused) << "until the setpoints have ceased";
  b.setpoints = false;
  b.Run(3.0);
  b.setpoints = true;
  EXPECT_TRUE(b.RunUntil(State::kFlying, 12.0)) << b.bridge.Words();
}

TEST(FcuBridge, ACheckThatPassesLaterIsWaitedFor) {
  StandInOptions options;
  options.preflight = "heading estimate not stable";
  Flight flight(options);
  ASSERT_TRUE(flight.RunUntil(State::kArming, 12.0));
  flight.Run(3.0);
  EXPECT_TRUE(flight.Says("arming was refused (not now): Arming denied: "));
  EXPECT_TRUE(flight.Says("Preflight Fail: heading estimate not stable"));
  flight.Run(7.0);
  flight.px4.options().preflight.clear();
  EXPECT_TRUE(flight.RunUntil(State::kFlying, 5.0)) << flight.bridge.Words();
}

TEST(FcuBridge, ARefusedLandingIsSaidAndAskedForAgain) {
  StandInOptions options;
  options.refuses_to_land = true;
  options.com_of_loss_t = 10.0;  // s in which it does not land by itself
  Flight flight(options);
  flight.TakeOff(5.0);
  flight.setpoints = false;
  ASSERT_TRUE(flight.RunUntil(State::kLanding, 2.0));
  for (int i = 0; i < 20; ++i) {
    flight.Run(0.2);
    EXPECT_TRUE(flight.Says("the autopilot lands; landing was refused (denied)"));
  }
  flight.px4.options().refuses_to_land = false;
  flight.Run(1.5);
  EXPECT_TRUE(flight.px4.mode() == kLandMode);
  EXPECT_FALSE(flight.Says("was refused"));
}

TEST(FcuBridge, ARefusalIsNotSaidOnceItLandsByItself) {
  StandInOptions options;
  options.refuses_to_land = true;
  options.com_of_loss_t = 3.0;
  Flight flight(options);
  flight.TakeOff(5.0);
  flight.setpoints = false;
  flight.Run(2.5);
  EXPECT_TRUE(flight.Says("landing was refused (denied)"));
  flight.Run(2.0);
  ASSERT_TRUE(flight.px4.mode() == kLandMode);
  EXPECT_FALSE(flight.Says("was refused"));
}

TEST(FcuBridge, AnotherMakesAutopilotIsLeftAlone) {
  StandInOptions options;
  options.autopilot = 3;
  Flight flight(options);
  flight.Run(10.0);
  EXPECT_EQ(flight.state(), State::kNoAutopilot);
  EXPECT_LE(flight.px4.seen().commands, 2) << "who it is";
  EXPECT_NE(flight.bridge.autopilot().stranger(), "");
}

TEST(FcuBridge, ResetsAreCountedPerEpoch) {
  Flight flight;
  flight.setpoints = false;
  flight.poses = false;
  flight.Run(3.0);
  Pose pose;
  pose.usable = true;
  uint8_t expected = 0;
  for (const int32_t epoch : {5, 5, 261, 261, -3, 5}) {
    static int32_t last = 5;
    if (epoch != last) ++expected;
    last = epoch;
    pose.epoch = epoch;
    pose.utime = flight.now();
    flight.bridge.OnPose(pose, flight.now());
    flight.Run(0.03);
    EXPECT_EQ(flight.px4.seen().vision->reset_counter, expected);
  }
}

/// A heartbeat of a PX4 of that system.
std::vector<uint8_t> Beat(uint8_t system, int64_t utime) {
  FrameWriter writer(system, 1);
  mav::Heartbeat m;
  m.autopilot = 12;
  return writer.Write(utime, m);
}

TEST(FcuBridge, AnswersWhomTheHeartbeatCameFromAndNobodyElseWhileItBeats) {
  Bridge bridge{FcuConfig{}};
  int64_t now = kFlightStart;
  const auto hear = [&](const std::vector<uint8_t>& bytes, uint64_t from) {
    bridge.Receive(now, now, bytes.data(), bytes.size(), true, from);
    bridge.Tick(now);
    return bridge.peer();
  };
  FrameWriter writer(1, 1);
  mav::AttitudeQuaternion attitude;
  attitude.q1 = 1.0f;
  EXPECT_EQ(hear(writer.Write(now, attitude), 7), 7u) << "who is asked for a heartbeat";
  EXPECT_FALSE(bridge.autopilot().attitude());
  EXPECT_EQ(hear(Beat(1, now), 5), 5u);
  EXPECT_EQ(hear(Beat(1, now), 6), 5u) << "in its name, from elsewhere";
  EXPECT_EQ(hear(Beat(2, now), 6), 5u);
  hear(writer.Write(now, attitude), 6);
  EXPECT_FALSE(bridge.autopilot().attitude());
  hear(writer.Write(now, attitude), 5);
  EXPECT_TRUE(bridge.autopilot().attitude());
  now += 2'000'000;
  EXPECT_EQ(hear(Beat(1, now), 6), 5u);
  now += 1'500'000;
  EXPECT_EQ(hear(writer.Write(now, attitude), 6), 5u) << "silent, but this is no heartbeat";
  EXPECT_EQ(hear(Beat(1, now), 6), 6u);
}

}  // namespace
}  // namespace chase::fcu::testing
