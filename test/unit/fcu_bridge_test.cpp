#include <gtest/gtest.h>

#include <cstdio>
#include <functional>

#include "common/bus/autopilot_state.h"
#include "fcu_flight.h"
#include "services/fcu/bridge.h"

namespace chase::fcu::testing {
namespace {

using State = Handshake::State;

/// Flies on until it holds, `most` s at most; prints and returns how long that took, s.
double Took(Flight* flight, const char* what, double most, const std::function<bool()>& holds) {
  const int64_t begin = flight->now();
  flight->Run(most, holds);
  EXPECT_TRUE(holds()) << what << ": " << flight->bridge.Words();
  const double seconds = 1e-6 * static_cast<double>(flight->now() - begin);
  std::printf("%s: %.2f s\n", what, seconds);
  return seconds;
}

double Took(Flight* flight, const char* what, double most, State state) {
  return Took(flight, what, most, [&] { return flight->bridge.handshake().state() == state; });
}

TEST(FcuBridge, TakesOffHoversLandsAndDisarms) {
  Flight flight;
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0)) << flight.bridge.Words();
  flight.Run(10.0);
  EXPECT_NEAR(flight.px4.p_WB().z(), 1.5, 0.1);
  EXPECT_NE(flight.bridge.Words().find("armed, in air"), std::string::npos)
      << flight.bridge.Words();
  flight.height = -1.0;  // onto the ground and pushed down
  flight.Run(8.0, [&] { return flight.px4.p_WB().z() <= 0.0; });
  flight.Run(0.5);
  flight.motors = false;
  ASSERT_TRUE(flight.RunUntil(State::kDone, 8.0)) << flight.bridge.Words();
  EXPECT_FALSE(flight.px4.armed());
  const std::vector<std::string> expected = {"no autopilot",        "standby", "streaming",
                                             "asking for OFFBOARD", "arming",  "flying",
                                             "disarming",           "done"};
  auto states = flight.states;
  // The clock is not known at first: it may wait in standby; the landing may be the autopilot's.
  states.erase(std::remove(states.begin(), states.end(), "landing"), states.end());
  EXPECT_EQ(states, expected);
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
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.Run(10.0);
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
  ASSERT_EQ(flight.bridge.handshake().state(), State::kFlying);
  EXPECT_NEAR(flight.px4.seen().longest_setpoint_gap, 0.2, 0.06) << flight.bridge.Words();
  EXPECT_FALSE(said("10")) << flight.bridge.Words();
}

// Until then a pose would count as measured when it arrives.
TEST(FcuBridge, NoFlightBeginsBeforeTheAutopilotKnowsOurClock) {
  Flight flight;
  flight.Run(3.0);
  EXPECT_EQ(flight.bridge.handshake().state(), State::kStandby);
  EXPECT_NE(flight.bridge.missing().find("learns our clock"), std::string::npos)
      << flight.bridge.missing();
  ASSERT_TRUE(flight.RunUntil(State::kStreaming, 4.0)) << flight.bridge.missing();
  flight.Run(0.1);  // the last answers are on their way
  const int64_t stamp = flight.now() - 100'000;
  const auto host = flight.px4.HostTime(static_cast<uint64_t>(stamp));
  ASSERT_TRUE(host);
  EXPECT_NEAR(static_cast<double>(*host - stamp), 0.0, 2000.0);
}

// It counts what reaches it, and leaves out what takes longer than 10 ms there and back.
TEST(FcuBridge, NorWhereAnswersToItAreLost) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    Flight flight({}, {}, seed);
    flight.loss = 0.3;
    ASSERT_TRUE(flight.RunUntil(State::kStreaming, 30.0)) << flight.bridge.missing();
    const int64_t stamp = flight.now() - 100'000;
    const auto host = flight.px4.HostTime(static_cast<uint64_t>(stamp));
    ASSERT_TRUE(host);
    EXPECT_NEAR(static_cast<double>(*host - stamp), 0.0, 5000.0) << seed;
  }
}

TEST(FcuBridge, NorWhereTheyTakeTooLong) {
  Flight flight;
  flight.delay = 6'000;
  flight.Run(20.0);
  EXPECT_EQ(flight.bridge.handshake().state(), State::kStandby);
  EXPECT_NE(flight.bridge.missing().find("learns our clock: 0 of 500"), std::string::npos)
      << flight.bridge.missing();
}

TEST(FcuBridge, NorWhereThePilotHasArmedOnTheGround) {
  FcuConfig config;
  config.engage = "pilot";
  Flight flight({}, config);
  flight.px4.PilotArms(true);
  flight.Run(3.0);
  EXPECT_EQ(flight.px4.seen().setpoints, 0);
  EXPECT_NE(flight.bridge.missing().find("learns our clock"), std::string::npos)
      << flight.bridge.missing();
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
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.Run(5.0);
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
  flight.bridge.OnFlightState(true);
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.bridge.OnFlightState(false);
  flight.Run(5.0);
  flight.setpoints = false;  // control hangs
  ASSERT_TRUE(flight.RunUntil(State::kStandby, 30.0)) << flight.bridge.Words();
  flight.setpoints = true;
  flight.bridge.OnFlightState(false);
  flight.Run(20.0);
  EXPECT_FALSE(flight.px4.armed());
  flight.bridge.OnFlightState(true);
  EXPECT_TRUE(flight.RunUntil(State::kFlying, 12.0)) << flight.bridge.Words();
}

// PX4 refuses a plain disarming in the air.
TEST(FcuBridge, OnlyAKillCutsTheMotorsInTheAir) {
  Flight flight;
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.Run(5.0);
  flight.motors = false;
  flight.Run(0.5);
  EXPECT_EQ(flight.bridge.handshake().state(), State::kLanding) << flight.bridge.Words();
  EXPECT_TRUE(flight.px4.armed());
  ASSERT_GT(flight.px4.p_WB().z(), 0.5);
  flight.bridge.Kill();
  flight.Run(0.1);
  EXPECT_FALSE(flight.px4.armed());
  EXPECT_TRUE(flight.RunUntil(State::kDone, 1.5)) << flight.bridge.Words();
  EXPECT_NE(flight.bridge.Words().find("killed by command"), std::string::npos);
}

TEST(FcuBridge, AKillIsSentUntilItIsObeyed) {
  StandInOptions options;
  options.lost_acks = 1.0;
  Flight flight(options);
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.Run(5.0);
  flight.link = false;
  flight.bridge.Kill();
  flight.Run(0.7);
  EXPECT_TRUE(flight.px4.armed());
  flight.link = true;
  flight.Run(0.7);
  EXPECT_FALSE(flight.px4.armed());
}

TEST(FcuBridge, AKillIsNotForAPilotWhoHasItNorForTheFlightToCome) {
  Flight flight;
  flight.setpoints = false;
  flight.Run(3.0);
  flight.bridge.Kill();
  flight.setpoints = true;
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0)) << flight.bridge.Words();
  flight.Run(5.0);
  flight.px4.PilotMode({3, 0});
  ASSERT_TRUE(flight.RunUntil(State::kPilot, 2.0));
  flight.bridge.Kill();
  flight.Run(3.0);
  EXPECT_TRUE(flight.px4.armed());
}

// He took it from a failsafe a moment ago.
TEST(FcuBridge, AKillIsNotForAPilotWhoHasJustTakenIt) {
  for (int i = 0; i < 10; ++i) {
    Flight flight;
    ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
    flight.Run(5.0 + 0.1 * i);
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

TEST(FcuBridge, AKillIsNotForAPilotOnALowBattery) {
  Flight flight;
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0)) << flight.bridge.Words();
  flight.Run(5.0);
  flight.px4.SetCharge(0.1);
  flight.Run(2.0);
  ASSERT_TRUE(flight.px4.failsafe()) << "a warning, which PX4 calls critical";
  EXPECT_EQ(flight.bridge.handshake().state(), State::kFlying) << flight.bridge.Words();
  flight.px4.PilotMode({3, 0});
  flight.Run(1.1);
  EXPECT_EQ(flight.bridge.handshake().state(), State::kPilot) << flight.bridge.Words();
  flight.bridge.Kill();
  flight.Run(3.0);
  EXPECT_TRUE(flight.px4.armed());
  EXPECT_TRUE(flight.px4.mode() == (Mode{3, 0}));
}

TEST(FcuBridge, ARepeatedSetpointIsNoFreshOne) {
  Flight flight;
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.Run(3.0);
  flight.setpoints = false;
  Setpoint setpoint;
  setpoint.motors = true;
  setpoint.thrust = 9.81;
  const int64_t stuck = flight.now();
  for (int i = 0; i < 400; ++i) {
    flight.bridge.OnSetpoint(setpoint, stuck, flight.now());
    flight.Run(0.0025);
  }
  EXPECT_EQ(flight.bridge.handshake().state(), State::kLanding);
}

// A stalled process finds them one after another, each as if it had just come.
TEST(FcuBridge, ASetpointThatWaitedInAQueueIsNotSent) {
  Flight flight;
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.Run(3.0);
  flight.setpoints = false;
  flight.Run(0.3);
  const int sent = flight.px4.seen().setpoints;
  Setpoint setpoint;
  setpoint.motors = true;
  setpoint.thrust = 9.81;
  for (int i = 0; i < 20; ++i) {
    flight.bridge.OnSetpoint(setpoint, flight.now() - 250'000, flight.now());
    flight.Run(0.005);
  }
  EXPECT_EQ(flight.px4.seen().setpoints, sent);
  flight.bridge.OnSetpoint(setpoint, flight.now() - 50'000, flight.now());
  flight.Run(0.005);
  EXPECT_EQ(flight.px4.seen().setpoints, sent + 1);
}

// The autopilot's own attitude is the better one then.
TEST(FcuBridge, ClosesNoAttitudeLoopOnAPoseThatIsOldOrBad) {
  FcuConfig config;
  config.body_rates = true;
  Flight flight({}, config);
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.Run(3.0);
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
  EXPECT_EQ(flight.bridge.handshake().state(), State::kFlying);
}

TEST(FcuBridge, LandsWhenThePoseHasBeenSilentForTooLong) {
  Flight flight;
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.Run(5.0);
  flight.poses = false;
  flight.Run(0.3);
  const int odometry = flight.px4.seen().odometry;
  flight.Run(1.5);
  EXPECT_EQ(flight.bridge.handshake().state(), State::kFlying) << "control has its two seconds";
  Took(&flight, "estimate stale for 1.8 s, it lands", 0.5, State::kLanding);
  EXPECT_EQ(flight.px4.seen().odometry, odometry);
}

TEST(FcuBridge, BeginsNothingWithoutAPose) {
  Flight flight;
  flight.poses = false;
  flight.Run(10.0);
  EXPECT_EQ(flight.bridge.handshake().state(), State::kStandby);
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
  EXPECT_NE(flight.bridge.missing().find("29 degrees off"), std::string::npos)
      << flight.bridge.missing();
  EXPECT_EQ(flight.px4.seen().times_armed, 0);
}

TEST(FcuBridge, ThePilotTakesItAtOnceAndForGood) {
  Flight flight;
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.Run(5.0);
  flight.px4.PilotMode({3, 0});
  Took(&flight, "the pilot takes over, no stream any more", 0.2, State::kPilot);
  const auto before = flight.px4.seen();
  flight.Run(20.0);
  EXPECT_EQ(flight.px4.seen().setpoints, before.setpoints);
  EXPECT_EQ(flight.px4.seen().offboard_commands, before.offboard_commands);
  EXPECT_EQ(flight.bridge.handshake().state(), State::kPilot) << "setpoints still come";
  flight.setpoints = false;
  flight.Run(5.0);
  EXPECT_EQ(flight.bridge.handshake().state(), State::kPilot) << "still armed";
  flight.px4.PilotArms(false);
  EXPECT_TRUE(flight.RunUntil(State::kStandby, 5.0));
  flight.px4.PilotMode({3, 0});
  flight.setpoints = true;
  EXPECT_TRUE(flight.RunUntil(State::kFlying, 12.0)) << "another flight";
}

// He may take it from a landing, too. The heartbeat of its own accord comes once a second.
TEST(FcuBridge, IsToldWithinAMomentWhoFlies) {
  for (const bool lands : {false, true}) {
    for (int i = 0; i < 10; ++i) {
      Flight flight;
      ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
      flight.Run(5.0 + 0.1 * i);
      if (lands) {
        flight.motors = false;
        flight.Run(1.0, [&] { return flight.px4.mode() == kLandMode; });
        flight.Run(0.5);
        ASSERT_EQ(flight.bridge.handshake().state(), State::kLanding);
      }
      flight.px4.PilotMode({3, 0});
      EXPECT_TRUE(flight.RunUntil(State::kPilot, 0.2)) << flight.bridge.Words();
      const int beats = flight.heartbeats;
      flight.Run(10.0);
      EXPECT_NEAR(flight.heartbeats - beats, 10, 1) << "no more than it needs";
    }
  }
}

TEST(FcuBridge, AFailsafeIsLatchedThoughTheStreamCouldComeBack) {
  StandInOptions options;
  options.com_of_loss_t = 0.3;  // shorter than our own patience
  Flight flight(options);
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.Run(5.0);
  flight.setpoints = false;
  flight.Run(0.45);
  ASSERT_TRUE(flight.px4.failsafe());
  flight.Run(0.04);
  flight.setpoints = true;
  flight.Run(1.5);
  // Either a heartbeat told us and it is latched, or the stream was back before.
  const State state = flight.bridge.handshake().state();
  EXPECT_TRUE(state == State::kFailsafe || state == State::kFlying) << flight.bridge.Words();
  EXPECT_EQ(flight.px4.mode() == kOffboardMode, state == State::kFlying);
}

TEST(FcuBridge, LinkLossEndsInALatchedFailsafe) {
  Flight flight;
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.Run(5.0);
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
  EXPECT_NE(flight.bridge.Words().find("the link was cut, or this bridge stood still"),
            std::string::npos);
}

TEST(FcuBridge, TheSticksTakeItAndALostTransmitterLands) {
  StandInOptions options;
  options.transmitter = true;
  Flight sticks(options);
  ASSERT_TRUE(sticks.RunUntil(State::kFlying, 12.0));
  sticks.Run(3.0);
  EXPECT_NE(sticks.bridge.Words().find("receiver heard"), std::string::npos);
  sticks.px4.PilotSticks(0.2);
  sticks.Run(1.5);
  EXPECT_EQ(sticks.bridge.handshake().state(), State::kFlying) << "not far enough";
  sticks.px4.PilotSticks(0.6);
  EXPECT_TRUE(sticks.RunUntil(State::kPilot, 1.1)) << sticks.bridge.Words();
  const int sent = sticks.px4.seen().setpoints;
  sticks.Run(10.0);
  EXPECT_EQ(sticks.px4.seen().setpoints, sent);
  EXPECT_TRUE(sticks.px4.mode() == (Mode{3, 0}));

  Flight lost(options);
  ASSERT_TRUE(lost.RunUntil(State::kFlying, 12.0));
  lost.Run(3.0);
  lost.px4.options().transmitter = false;
  EXPECT_TRUE(lost.RunUntil(State::kFailsafe, 2.0)) << lost.bridge.Words();
  EXPECT_NE(lost.bridge.Words().find("Manual control lost"), std::string::npos);
  lost.Run(10.0);
  EXPECT_FALSE(lost.px4.armed()) << "landed, though setpoints come";
}

// COM_FAIL_ACT_T as PX4 has it: it holds, then lands; no stream ends either.
TEST(FcuBridge, AHoldBeforeTheLandingIsAFailsafeToo) {
  StandInOptions options;
  options.com_fail_act_t = 5.0;
  Flight flight(options);
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.Run(5.0);
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
TEST(FcuBridge, ACutOfAnyLengthIsBorneOrLatched) {
  for (int ms = 100; ms <= 1600; ms += 50) {
    Flight flight;
    ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
    flight.Run(3.0 + 0.037 * ms / 50.0);  // anywhere between two heartbeats
    flight.link = false;
    flight.Run(1e-3 * ms);
    flight.link = true;
    bool failed = flight.px4.failsafe();
    for (int i = 0; i < 2000; ++i) {
      flight.Run(0.0025);
      failed = failed || flight.px4.failsafe();
      EXPECT_FALSE(failed && flight.px4.mode() == kOffboardMode) << ms;
      if (flight.px4.mode() == kOffboardMode && failed) break;
    }
    EXPECT_EQ(failed, ms > 750) << ms << flight.bridge.Words();
    EXPECT_EQ(flight.bridge.handshake().state() == State::kFlying, !failed)
        << ms << flight.bridge.Words();
  }
}

// The same where the bridge itself stood still: what came in meanwhile is of before.
TEST(FcuBridge, ABridgeThatStoodStillDoesNotEndAFailsafe) {
  for (const double seconds : {0.3, 0.45, 0.6, 0.9, 1.2, 1.9}) {
    Flight flight;
    ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
    flight.Run(5.0);
    flight.bridge_runs = false;
    flight.Run(seconds);
    flight.bridge_runs = true;
    bool failed = flight.px4.failsafe();
    for (int i = 0; i < 2000; ++i) {
      flight.Run(0.0025);
      failed = failed || flight.px4.failsafe();
      ASSERT_FALSE(failed && flight.px4.mode() == kOffboardMode) << seconds;
    }
    EXPECT_EQ(failed, seconds > 0.75) << seconds << flight.bridge.Words();
  }
}

// A heartbeat is up to a second old: AUTO.LAND would take it from him.
TEST(FcuBridge, ALandingIsNotAskedOfAPilotWhoHasJustTakenIt) {
  for (const double before : {0.02, 0.3, 0.8}) {
    Flight flight;
    ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
    flight.Run(5.0);
    const int beats = flight.heartbeats;
    flight.Run(1.5, [&] { return flight.heartbeats > beats; });
    flight.px4.PilotMode({3, 0});
    flight.Run(before);
    flight.motors = false;
    flight.Run(5.0);
    EXPECT_TRUE(flight.px4.mode() == (Mode{3, 0})) << before;
    EXPECT_EQ(flight.bridge.handshake().state(), State::kPilot) << flight.bridge.Words();
  }
}

TEST(FcuBridge, ABridgeThatBeginsAnewDoesNotStreamIntoAFailsafe) {
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
  EXPECT_NE(flight.bridge.Words().find("in a failsafe"), std::string::npos);
  flight.px4.PilotMode({3, 0});
  ASSERT_TRUE(flight.RunUntil(State::kStreaming, 3.0)) << "the pilot has ended it";
}

// It hears the last heartbeat of before long before it knows the clock; what came in between it
// cannot know.
TEST(FcuBridge, ABridgeThatBeganAnewTrustsNoHeartbeatOfBefore) {
  int borne = 0;
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    for (const bool pilot : {false, true}) {
      Flight flight({}, {}, seed);
      ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
      flight.Run(3.0 + 0.09 * static_cast<double>(seed));
      flight.bridge = Bridge(FcuConfig{});
      flight.bridge_runs = false;
      flight.Run(0.05 * static_cast<double>(seed));
      flight.bridge_runs = true;
      ASSERT_TRUE(flight.RunUntil(State::kStandby, 1.5)) << flight.bridge.Words();
      flight.Run(0.01);
      if (pilot) flight.px4.PilotMode({3, 0});
      const int before = flight.px4.seen().setpoints_while_not_offboard;
      bool failed = false;
      for (int i = 0; i < 2000; ++i) {
        flight.Run(0.0025);
        failed = failed || flight.px4.failsafe();
        ASSERT_FALSE(failed && flight.px4.mode() == kOffboardMode) << seed;
      }
      EXPECT_EQ(flight.px4.seen().setpoints_while_not_offboard, before) << seed << pilot;
      if (!pilot) {
        EXPECT_EQ(flight.bridge.handshake().state() == State::kFlying, !failed) << seed;
      }
      borne += !pilot && !failed;
    }
  }
  EXPECT_GE(borne, 5) << "restarts that the flight outlives";
}

TEST(FcuBridge, RefusalsAreSaidInWordsAndGivenUp) {
  StandInOptions refuses;
  refuses.refuses_offboard = true;
  Flight a(refuses);
  ASSERT_TRUE(a.RunUntil(State::kRefused, 12.0));
  EXPECT_NE(a.bridge.Words().find("OFFBOARD was refused (denied)"), std::string::npos)
      << a.bridge.Words();
  const int sent = a.px4.seen().setpoints;
  a.Run(5.0);
  EXPECT_EQ(a.px4.seen().setpoints, sent) << "given up: no stream any more";
  EXPECT_EQ(a.px4.seen().offboard_commands, 1);

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
  EXPECT_EQ(b.bridge.handshake().state(), State::kRefused) << "until the setpoints have ceased";
  b.setpoints = false;
  b.Run(3.0);
  b.setpoints = true;
  EXPECT_TRUE(b.RunUntil(State::kFlying, 12.0)) << b.bridge.Words();
}

TEST(FcuBridge, AnEmptyBatteryLandsAndIsNoFlightAfterwards) {
  Flight flight;
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.Run(5.0);
  flight.px4.SetCharge(0.04);
  Took(&flight, "battery empty, the autopilot lands and the bridge lets it", 3.0, State::kFailsafe);
  EXPECT_NE(flight.bridge.Words().find("Emergency battery level"), std::string::npos)
      << flight.bridge.Words();
  EXPECT_TRUE(flight.px4.mode() == kLandMode);
  flight.Run(12.0);
  EXPECT_FALSE(flight.px4.armed()) << "landed and disarmed, with the setpoints still coming";
  flight.setpoints = false;
  flight.Run(3.0);
  flight.setpoints = true;
  flight.Run(8.0);
  EXPECT_FALSE(flight.px4.armed()) << "arming is refused: " << flight.bridge.Words();
}

TEST(FcuBridge, ACheckThatPassesLaterIsWaitedFor) {
  StandInOptions options;
  options.preflight = "heading estimate not stable";
  Flight flight(options);
  ASSERT_TRUE(flight.RunUntil(State::kArming, 12.0));
  flight.Run(10.0);
  flight.px4.options().preflight.clear();
  EXPECT_TRUE(flight.RunUntil(State::kFlying, 5.0)) << flight.bridge.Words();
}

TEST(FcuBridge, ThePilotMayBeTheOneWhoEngages) {
  FcuConfig config;
  config.engage = "pilot";
  Flight flight({}, config);
  ASSERT_TRUE(flight.RunUntil(State::kStreaming, 12.0));
  flight.Run(10.0);
  EXPECT_EQ(flight.bridge.handshake().state(), State::kStreaming);
  EXPECT_EQ(flight.px4.seen().offboard_commands, 0);
  flight.px4.PilotMode(kOffboardMode);
  flight.px4.PilotArms(true);
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 3.0));
  flight.px4.PilotMode({3, 0});
  ASSERT_TRUE(flight.RunUntil(State::kStreaming, 3.0)) << "he may give it back";
  flight.px4.PilotMode(kOffboardMode);
  EXPECT_TRUE(flight.RunUntil(State::kFlying, 3.0));
}

TEST(FcuBridge, APilotInTheAirIsNotInterfered) {
  Flight flight;
  flight.px4.PilotArms(true);
  flight.Run(15.0);
  EXPECT_EQ(flight.px4.seen().setpoints, 0);
  EXPECT_EQ(flight.px4.seen().offboard_commands, 0);
}

TEST(FcuBridge, GoesOnWhereItBeganAnewInMidFlight) {
  Flight flight;
  ASSERT_TRUE(flight.RunUntil(State::kFlying, 12.0));
  flight.Run(5.0);
  StandInOptions options;
  flight.bridge = Bridge(FcuConfig{});
  Took(&flight, "bridge killed and restarted, it knows who flies", 2.5, [&] {
    const State state = flight.bridge.handshake().state();
    return state == State::kFlying || state == State::kFailsafe || state == State::kPilot;
  });
  flight.Run(0.5);
  // The clock takes half a second and the heartbeat one: longer than COM_OF_LOSS_T may bear, so
  // either is right, but never a second arming.
  EXPECT_EQ(flight.px4.seen().times_armed, 1);
  flight.Run(30.0);
  EXPECT_EQ(flight.px4.seen().times_armed, 1);
}

TEST(FcuBridge, AnAutopilotThatBeginsAnewIsAskedForItsStreamsAgain) {
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
  EXPECT_TRUE(flight.bridge.handshake().state() == State::kFailsafe ||
              flight.bridge.handshake().state() == State::kDone)
      << flight.bridge.Words();
  flight.Run(10.0);
  EXPECT_EQ(flight.px4.seen().times_armed, 1) << "not armed again by itself";
}

TEST(FcuBridge, AnAutopilotWhoseClockGoesBackIsTakenUpAgainWithinASecond) {
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

TEST(FcuBridge, AnotherMakesAutopilotIsLeftAlone) {
  StandInOptions options;
  options.autopilot = 3;
  Flight flight(options);
  flight.Run(10.0);
  EXPECT_EQ(flight.bridge.handshake().state(), State::kNoAutopilot);
  EXPECT_EQ(flight.px4.seen().commands, 0);
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
  EXPECT_EQ(hear(writer.Write(now, attitude), 7), 0u) << "no heartbeat";
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

TEST(FcuBridge, ItsWordsTellWhoFliesAndWhereItStands) {
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

// Whatever is lost on the way: it flies, and it ends.
TEST(FcuBridge, FliesAndEndsOnALossyLink) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    StandInOptions options;
    options.lost_acks = 0.5;
    Flight flight(options, {}, seed);
    flight.loss = 0.2;
    ASSERT_TRUE(flight.RunUntil(State::kFlying, 30.0)) << seed << flight.bridge.Words();
    flight.Run(5.0);
    EXPECT_EQ(flight.bridge.handshake().state(), State::kFlying) << seed << flight.bridge.Words();
    flight.setpoints = false;
    ASSERT_TRUE(flight.RunUntil(State::kDone, 40.0)) << seed << flight.bridge.Words();
    EXPECT_FALSE(flight.px4.armed());
  }
}

}  // namespace
}  // namespace chase::fcu::testing
