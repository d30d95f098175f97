#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "simulator_px4_link.h"

namespace chase::simulator::testing {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

const auto kImu = static_cast<float>(mav::HighresImu::kId);

TEST(Px4, StreamsAtTheIntervalThatIsAskedFor) {
  Link link;
  EXPECT_NEAR(link.Second()[mav::HighresImu::kId], 50, 2);
  EXPECT_EQ(link.Ask(kImu, 10'000.0f), mav::MavResult::ACCEPTED);
  EXPECT_NEAR(link.Second()[mav::HighresImu::kId], 100, 1);
  EXPECT_EQ(link.Ask(kImu, -1.0f), mav::MavResult::ACCEPTED);  // no more
  EXPECT_EQ(link.Second()[mav::HighresImu::kId], 0);
  EXPECT_EQ(link.Ask(kImu, 0.0f), mav::MavResult::ACCEPTED);  // as at first
  EXPECT_NEAR(link.Second()[mav::HighresImu::kId], 50, 2);
  const auto unusual = static_cast<float>(mav::BatteryStatus::kId);  // its default rate is none
  EXPECT_EQ(link.Ask(unusual, 100'000.0f), mav::MavResult::ACCEPTED);
  EXPECT_NEAR(link.Second()[mav::BatteryStatus::kId], 10, 1);
  EXPECT_EQ(link.battery().voltages[0], 16'240) << "mV, the pack at 80 %: it knows no cells";
  EXPECT_EQ(link.battery().voltages[1], UINT16_MAX) << "no cell";
  EXPECT_EQ(link.Ask(unusual, 0.0f), mav::MavResult::ACCEPTED);
  EXPECT_EQ(link.Second()[mav::BatteryStatus::kId], 0);
}

TEST(Px4, RefusesIntervalsThatAreNone) {
  Link link;
  for (const float interval : {kNaN, kInfinity, -kInfinity, -2.0f, -0.5f, 1e30f})
    EXPECT_EQ(link.Ask(kImu, interval), mav::MavResult::DENIED) << interval;
  for (const float id : {kNaN, kInfinity, -1.0f, 1e9f})
    EXPECT_EQ(link.Ask(id, 10'000.0f), mav::MavResult::DENIED) << id;
  EXPECT_NEAR(link.Second()[mav::HighresImu::kId], 50, 2);
}

TEST(Px4, FailsForTheHeartbeatAndForWhatItHasNoStreamOf) {
  Link link;
  for (const uint32_t id : {mav::Heartbeat::kId, mav::RcChannels::kId, mav::RawImu::kId, 77'777u})
    for (const float interval : {-1.0f, 0.0f, 10'000.0f})
      EXPECT_EQ(link.Ask(static_cast<float>(id), interval), mav::MavResult::FAILED) << id;
  EXPECT_NEAR(link.Second()[mav::Heartbeat::kId], 1, 1);
}

TEST(Px4, SendsOnceWhatIsAskedForAndItsOwnAsBefore) {
  Link link;
  link.Second();
  int sent = 0;
  for (int i = 0; i < 20; ++i) {
    mav::CommandLong m;
    m.command = static_cast<uint16_t>(mav::MavCmd::REQUEST_MESSAGE);
    m.target_system = m.target_component = 1;
    m.param1 = static_cast<float>(mav::Heartbeat::kId);
    link.Send(m);
    sent += link.Seconds(0.2)[mav::Heartbeat::kId];
  }
  EXPECT_EQ(sent, 24) << "twenty that were asked for, four of its own accord";
}

TEST(Px4, DeniesModesThatItDoesNotKnow) {
  Link link;
  const auto mode = [&](float main, float sub) {
    return link.Command(mav::MavCmd::DO_SET_MODE, 1.0f, main, sub);
  };
  for (const float bad : {kNaN, kInfinity, -1.0f, 0.0f, 1e9f, 262.0f, 6.5f})
    EXPECT_EQ(mode(bad, 0.0f), mav::MavResult::DENIED) << bad;
  for (const float bad : {kNaN, 1e9f, -3.0f, 259.0f, 99.0f})
    EXPECT_EQ(mode(4.0f, bad), mav::MavResult::DENIED) << bad;
  for (const float base : {kNaN, kInfinity, 0.0f, 128.0f})  // no mode of PX4's own
    EXPECT_EQ(link.Command(mav::MavCmd::DO_SET_MODE, base, 4.0f, 6.0f), mav::MavResult::DENIED);
  EXPECT_TRUE(link.px4().mode() == mavlink::kPositionMode);
  EXPECT_EQ(mode(4.0f, 6.0f), mav::MavResult::ACCEPTED);
  EXPECT_TRUE(link.px4().mode() == mavlink::kLandMode);
}

TEST(Px4, TakesTheModesThatAPilotFlies) {
  Link link;
  for (const float main : {1.0f, 2.0f, 5.0f, 7.0f, 3.0f}) {
    EXPECT_EQ(link.Command(mav::MavCmd::DO_SET_MODE, 1.0f, main, 0.0f), mav::MavResult::ACCEPTED);
    EXPECT_EQ(link.px4().mode().main, main);
  }
}

// As PX4IO does: it is told of still, without channels.
TEST(Px4, TellsOfAReceiverThatHearsNobodyAnyMore) {
  Link link;
  link.px4().options().transmitter = true;
  ASSERT_EQ(link.Ask(static_cast<float>(mav::RcChannels::kId), 100'000.0f),
            mav::MavResult::ACCEPTED);
  link.Second();
  EXPECT_EQ(link.channels(), 8);
  link.px4().options().transmitter = false;
  EXPECT_NEAR(link.Second()[mav::RcChannels::kId], 10, 1);
  EXPECT_EQ(link.channels(), 0);
}

mav::Odometry Vision() {
  mav::Odometry m;
  m.q = {1.0f, 0.0f, 0.0f, 0.0f};
  m.x = 3.0f;
  m.frame_id = static_cast<uint8_t>(mav::MavFrame::LOCAL_FRD);
  m.child_frame_id = static_cast<uint8_t>(mav::MavFrame::BODY_FRD);
  m.estimator_type = static_cast<uint8_t>(mav::MavEstimatorType::VIO);
  return m;
}

TEST(Px4, TakesNoPoseThatIsNotFinite) {
  Link link;
  link.Send(Vision());
  ASSERT_EQ(link.px4().seen().odometry, 1);
  for (const float bad : {kNaN, kInfinity})
    for (int field = 0; field < 7; ++field) {
      mav::Odometry m = Vision();
      (field == 0   ? m.x
       : field == 1 ? m.y
       : field == 2 ? m.z
                    : m.q[static_cast<size_t>(field - 3)]) = bad;
      link.Send(m);
      EXPECT_EQ(link.px4().seen().odometry, 1) << field;
      EXPECT_EQ(link.px4().seen().vision->x, 3.0f) << field;
    }
  mav::Odometry m = Vision();
  m.vx = m.pose_covariance[0] = kNaN;  // not known, which is no fault
  link.Send(m);
  EXPECT_EQ(link.px4().seen().odometry, 2);
}

TEST(Px4, TakesThePosesOfTheEstimatorsAndFramesThatPx4Knows) {
  std::set<int> types, frames;
  for (int number = 0; number < 256; ++number) {
    Link link;
    mav::Odometry m = Vision();
    m.estimator_type = static_cast<uint8_t>(number);
    link.Send(m);
    if (link.px4().seen().odometry == 1) types.insert(number);
    m = Vision();
    m.frame_id = static_cast<uint8_t>(number);
    const int before = link.px4().seen().odometry;
    link.Send(m);
    if (link.px4().seen().odometry > before) frames.insert(number);
  }
  EXPECT_EQ(types, (std::set<int>{0, 1, 2, 3, 6})) << "unknown, naive, vision, VIO, MOCAP";
  EXPECT_EQ(frames, (std::set<int>{1, 4, 20, 21})) << "local: NED, ENU, FRD, FLU";
}

TEST(Px4, TakesPosesInTheFramesThatTheyName) {
  Link link;
  const auto seen = [&] { return *link.px4().seen().vision; };
  mav::Odometry m = Vision();
  m.y = 2.0f, m.z = 1.0f;
  m.q = {std::sqrt(0.5f), 0.0f, 0.0f, std::sqrt(0.5f)};  // heads east
  m.vx = 5.0f;
  link.Send(m);
  EXPECT_EQ(seen().vx, 5.0f);
  m.frame_id = static_cast<uint8_t>(mav::MavFrame::LOCAL_ENU);
  m.child_frame_id = static_cast<uint8_t>(mav::MavFrame::LOCAL_FRD);
  link.Send(m);
  EXPECT_EQ(seen().x, 2.0f);
  EXPECT_EQ(seen().y, 3.0f);
  EXPECT_EQ(seen().z, -1.0f);
  EXPECT_NEAR(seen().vy, -5.0f, 1e-5) << "northward is to the left";
  m.child_frame_id = 0;
  link.Send(m);
  EXPECT_TRUE(std::isnan(seen().vx)) << "a frame that PX4 does not know";
  link.px4().options().ekf2_ev_qmin = 1;
  const int before = link.px4().seen().odometry;
  m.quality = -1;
  link.Send(m);
  EXPECT_EQ(link.px4().seen().odometry, before) << "it says that it has failed";
}

TEST(Px4, RotationsAreOfUnitLength) {
  for (const float w : {0.0f, 1e-20f, 0.98f, 1.02f, 1e20f}) {
    Link link;
    mav::Odometry pose = Vision();
    mav::SetAttitudeTarget setpoint;
    setpoint.target_system = 1;
    pose.q = setpoint.q = {w, 0.0f, 0.0f, 0.0f};
    link.Send(pose);
    link.Send(setpoint);
    EXPECT_EQ(link.px4().seen().odometry + link.px4().seen().setpoints, 0) << w;
  }
  Link link;
  mav::Odometry pose = Vision();
  mav::SetAttitudeTarget setpoint;
  setpoint.target_system = 1;
  pose.q = setpoint.q = {1.004f, 0.0f, 0.0f, 0.0f};  // rounded by whoever sent it
  link.Send(pose);
  link.Send(setpoint);
  EXPECT_EQ(link.px4().seen().vision.value().q[0], 1.0f);
  EXPECT_EQ(link.px4().seen().setpoint.value().q[0], 1.0f);
}

/// Its demand under OFFBOARD by a setpoint with this thrust.
AttitudeSetpoint DemandFor(float thrust) {
  Link link;
  mav::SetAttitudeTarget m;
  m.q = {1.0f, 0.0f, 0.0f, 0.0f};
  m.target_system = 1;
  m.thrust = thrust;
  link.px4().PilotMode(mavlink::kOffboardMode);
  link.px4().PilotArms(true);
  link.Send(m);
  return link.px4().Demand({});
}

TEST(Px4, ThrustIsAShare) {
  const double most = 9.81 / Px4Options{}.hover;
  EXPECT_NEAR(DemandFor(0.5f).thrust, 9.81, 1e-6);
  EXPECT_NEAR(DemandFor(7.0f).thrust, most, 1e-6);
  EXPECT_NEAR(DemandFor(-1.0f).thrust, 0.0, 1e-6);
}

TEST(Px4, TakesNoSetpointThatIsNotFinite) {
  for (const float bad : {kNaN, kInfinity}) {
    Link link;
    mav::SetAttitudeTarget m;
    m.q = {1.0f, 0.0f, 0.0f, 0.0f};
    m.thrust = bad;
    link.Send(m);
    m.thrust = 0.5f;
    m.q[2] = bad;
    link.Send(m);
    EXPECT_EQ(link.px4().seen().setpoints, 0);
    m.type_mask = static_cast<uint8_t>(mav::AttitudeTargetTypemask::ATTITUDE_IGNORE);
    link.Send(m);  // rates: the attitude is left out
    EXPECT_EQ(link.px4().seen().setpoints, 1);
  }
}

TEST(Px4, KnowsTheLongestGapBetweenTheSetpointsThatItFliesBy) {
  Link link;
  const auto gap = [&] { return link.px4().seen().longest_setpoint_gap; };
  link.Setpoints(5, 300'000);
  EXPECT_EQ(gap(), 0.0) << "nobody flies by them";
  link.px4().PilotMode(mavlink::kOffboardMode);
  link.px4().PilotArms(true);
  link.Setpoints(50, 10'000);
  EXPECT_NEAR(gap(), 0.010, 1e-9) << "by their arrivals, however late they are looked at";
  link.Setpoints(1, 70'000);
  link.Setpoints(50, 10'000);
  EXPECT_NEAR(gap(), 0.070, 1e-9);
  link.px4().PilotMode(mavlink::kPositionMode);
  link.Setpoints(1, 500'000);
  link.px4().PilotMode(mavlink::kOffboardMode);
  link.Setpoints(50, 10'000);
  EXPECT_NEAR(gap(), 0.070, 1e-9) << "the pilot had it";
  link.Setpoints(1, 1'500'000);
  EXPECT_NEAR(gap(), 1.5, 1e-9) << "of the failsafe for their silence, too";
}

// PX4's Timesync: it takes what comes for stamped when it comes until 500 answers have come.
TEST(Px4, BelievesNoStampBeforeItsEstimateOfTheClockHasSettled) {
  Link link;
  link.Answer(1, 191, 5'000'000, 499);
  link.Send(Vision());
  const auto stamp = static_cast<uint64_t>(link.now() + 4'900'000);  // 0.1 s old
  EXPECT_EQ(link.px4().HostTime(stamp), link.now());
  link.Answer(1, 191, 5'000'000, 1);
  EXPECT_NEAR(static_cast<double>(*link.px4().HostTime(stamp) - link.now()), -1e5, 1000.0);
}

// A ground station answers as well, by a clock of its own.
TEST(Px4, TimesOfVisionAreOfTheClockOfItsSender) {
  Link link;
  link.Answer(1, 191, 5'000'000);
  link.Send(Vision());
  const auto stamp = static_cast<uint64_t>(link.now() + 5'000'000);
  ASSERT_TRUE(link.px4().HostTime(stamp));
  EXPECT_NEAR(static_cast<double>(*link.px4().HostTime(stamp) - link.now()), 0.0, 1000.0);
  link.Answer(255, 190, -9'000'000'000);
  EXPECT_NEAR(static_cast<double>(*link.px4().HostTime(stamp) - link.now()), 0.0, 1000.0);
}

TEST(Px4, AStampThatNoClockShowsHasNoTime) {
  Link link;
  link.Answer(1, 191, -9'000'000'000'000'000);  // the offset is as far away as TIMESYNC can say
  link.Send(Vision());
  for (const uint64_t stamp : {uint64_t{1} << 63, (uint64_t{1} << 63) - 1, ~uint64_t{0}})
    EXPECT_FALSE(link.px4().HostTime(stamp)) << stamp;
}

TEST(Px4, BeginsAnewWithItsOwnStreamsAndNobodysClock) {
  Link link;
  link.Answer(1, 191, 5'000'000);
  link.Send(Vision());
  link.Ask(kImu, 10'000.0f);
  ASSERT_TRUE(link.px4().HostTime(kStart));
  link.px4().Reboot(link.now());
  EXPECT_NEAR(link.Second()[mav::HighresImu::kId], 50, 2);
  EXPECT_FALSE(link.px4().HostTime(kStart));
}

}  // namespace
}  // namespace chase::simulator::testing
