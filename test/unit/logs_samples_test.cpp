#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/tracking_t.hpp"
#include "common/bus/convert.h"
#include "logs/src/flight_samples.h"
#include "test/unit/logs_flown.h"
#include "test/unit/logs_small_log.h"

namespace chase::logs {
namespace {

using namespace testing;

/// What is logged at an instant.
struct Logged {
  imu_t imu{};
  pose_t pose{};
  attitude_setpoint_t setpoint{};
  tracking_t tracking{};
};
/// What a test changes of the i-th instant; false: leaves it out.
using Change = std::function<bool(size_t i, Logged* m)>;

/// With biases that odometry knows of.
Logged At(const Motion& motion, const Asked& asked, int64_t utime) {
  Logged m;
  m.imu.utime = m.pose.utime = m.setpoint.utime = m.tracking.utime = utime;
  m.pose.accel_bias[1] = 0.2, m.pose.gyro_bias[2] = -0.1;
  bus::Set(m.imu.accel, motion.accel + Vector3d(0.0, 0.2, 0.0));
  bus::Set(m.imu.gyro, motion.w_WB_B - Vector3d(0.0, 0.0, 0.1));
  bus::Set(m.pose.orientation, motion.R_WB);
  bus::Set(m.pose.vel, motion.v_WB);
  bus::Set(m.setpoint.orientation, asked.R_WB);
  bus::Set(m.setpoint.body_rate, asked.w_WB_B);
  m.setpoint.thrust = asked.thrust;
  m.setpoint.motors = attitude_setpoint_t::MOTORS_ON;
  m.tracking.following = tracking_t::PLAN;
  return m;
}

/// The log of a flight; the first second is on the ground, the last is a landing.
std::string WriteFlight(const std::string& name, const FlightSamples& flight,
                        const Change& change = {}, const std::string& left_out = "",
                        const std::string& second = "") {
  const std::string file = testing::Temp(name);
  OutputLog log(file);
  for (size_t i = 0; i < flight.motions.size(); ++i) {
    const int64_t utime = 1'000'000 + 5'000 * static_cast<int64_t>(i);
    Logged m = At(flight.motions[i], flight.asked[i], utime);
    if (i < 200) bus::Set(m.pose.vel, Vector3d::Zero());
    if (i + 200 >= flight.motions.size()) m.tracking.following = tracking_t::LAND;
    if (change && !change(i, &m)) continue;
    const auto write = [&](const std::string& channel, const auto& message) {
      if (channel != left_out) log.Write(utime, channel, message);
      if (channel == second) log.Write(utime, "OTHER_" + channel, message);
    };
    write("IMU", m.imu);
    write("POSE", m.pose);
    write("ATTITUDE_SETPOINT", m.setpoint);
    write("TRACKING", m.tracking);
  }
  log.Close();
  return file;
}

TEST(ReadSamples, TakesWhatWasFlownInTheAirByPlans) {
  const FlightSamples flown = Fly(Body(), Course(), {}, 1, 10.0);
  const FlightSamples read = ReadSamples(WriteFlight("flown.lcm", flown));
  ASSERT_NEAR(static_cast<double>(read.motions.size()), 2000 - 400, 2);
  EXPECT_EQ(read.asked.size(), flown.asked.size());
  for (const Motion& m : read.motions) {
    const Motion& truth = flown.motions.at(static_cast<size_t>(std::lround(m.t / kStep)));
    EXPECT_LT((m.accel - truth.accel).norm() + (m.w_WB_B - truth.w_WB_B).norm(), 1e-9);
    EXPECT_LT((m.v_WB - truth.v_WB).norm(), 1e-9);
    EXPECT_EQ(m.stretch, read.motions.front().stretch);
  }
}

TEST(ReadSamples, VelocityIsUncertainAlongTheAxesOfTheBody) {
  FlightSamples flown = Fly(Body(), Course(), {}, 1, 10.0);
  const Eigen::Quaterniond left(Eigen::AngleAxisd(M_PI / 2.0, Vector3d::UnitZ()));
  for (Motion& m : flown.motions) m.R_WB = left, m.v_WB = Vector3d(2.0, 0.0, 0.0);
  const auto change = [](size_t, Logged* m) {
    const double variances[] = {0.01, 0.04, 0.09, 0.0, 1e-4, 4e-4};  // velocity, rotation
    for (int i = 0; i < 6; ++i) m->pose.local_covariance[10 * (i + 3)] = variances[i];
    return true;
  };
  const FlightSamples read = ReadSamples(WriteFlight("doubt.lcm", flown, change));
  ASSERT_FALSE(read.motions.empty());
  // x of B is y of W; where the axes are off, a share of the 2 m/s is taken for theirs.
  const Eigen::Matrix3d expected =
      Vector3d(0.04 + 4.0 * 4e-4, 0.01, 0.09 + 4.0 * 1e-4).asDiagonal();
  EXPECT_LT((read.motions[500].velocity_covariance - expected).norm(), 1e-12)
      << read.motions[500].velocity_covariance;
}

TEST(ReadSamples, LeavesOutWhatIsNoFlightByPlans) {
  const FlightSamples flown = Fly(Body(), Course(), {}, 1, 10.0);
  const size_t all = ReadSamples(WriteFlight("all.lcm", flown)).motions.size();
  const auto within = [](size_t i) { return i >= 1000 && i < 1100; };
  const std::map<std::string, Change> changes = {
      {"gap", [&](size_t i, Logged*) { return !within(i); }},
      {"lost",
       [&](size_t i, Logged* m) {
         if (within(i)) m->pose.health = pose_t::HEALTH_LOST;
         return true;
       }},
      {"correcting",
       [&](size_t i, Logged* m) {
         m->pose.correcting = within(i) ? 1 : 0;
         return true;
       }},
      {"motors off",
       [&](size_t i, Logged* m) {
         if (within(i)) m->setpoint.motors = attitude_setpoint_t::MOTORS_OFF;
         return true;
       }},
      {"held by hand", [&](size_t i, Logged* m) {
         if (within(i)) m->tracking.following = tracking_t::LAND;
         return true;
       }}};
  for (const auto& [name, change] : changes) {
    const FlightSamples read = ReadSamples(WriteFlight("part.lcm", flown, change));
    EXPECT_NEAR(static_cast<double>(all - read.motions.size()), 100.0, 2.0) << name;
    EXPECT_NE(read.motions.front().stretch, read.motions.back().stretch) << name;
    for (const Motion& m : read.motions) EXPECT_FALSE(m.t > 5.001 && m.t < 5.494) << name;
  }
}

TEST(ReadSamples, NothingIsReadAcrossAChangeOfTheFrame) {
  const FlightSamples flown = Fly(Body(), Course(), {}, 1, 10.0);
  const auto change = [](size_t i, Logged* m) {
    m->imu.utime += 2'500;  // between poses
    if (i < 1000) return true;
    m->pose.epoch = 7;
    m->pose.vel[0] += 100.0;
    m->pose.accel_bias[1] = 5.0;  // of another start of odometry
    return true;
  };
  const FlightSamples read = ReadSamples(WriteFlight("frame.lcm", flown, change));
  EXPECT_EQ(read.motions.back().stretch - read.motions.front().stretch, 1);
  for (const Motion& m : read.motions) {
    EXPECT_TRUE(m.v_WB.x() < 10.0 || m.v_WB.x() > 90.0) << m.t;
    EXPECT_TRUE(m.v_WB.x() > 90.0 || std::abs(m.accel.y()) < 4.0) << m.t;
  }
}

TEST(ReadSamples, SaysWhereAllAreMalformed) {
  const FlightSamples flown = Fly(Body(), Course(), {}, 1, 3.0);
  const auto change = [](size_t, Logged* m) {
    m->imu.accel[0] = std::nan("");
    return true;
  };
  const std::string log = WriteFlight("malformed.lcm", flown, change);
  EXPECT_NE(testing::ErrorOf([&] { ReadSamples(log); }).find("600 messages of IMU are malformed"),
            std::string::npos);
}

TEST(ReadSamples, SaysWhatIsMissing) {
  const FlightSamples flown = Fly(Body(), Course(), {}, 1, 3.0);
  for (const std::string channel : {"IMU", "POSE", "ATTITUDE_SETPOINT", "TRACKING"}) {
    const std::string without = WriteFlight("without.lcm", flown, {}, channel);
    EXPECT_EQ(testing::ErrorOf([&] { ReadSamples(without); }),
              without + ": holds no " + channel +
                  "; identify needs IMU, POSE, ATTITUDE_SETPOINT and TRACKING");
    const std::string two = WriteFlight("two.lcm", flown, {}, "", channel);
    EXPECT_NE(testing::ErrorOf([&] { ReadSamples(two); }).find(channel + " of several vehicles"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace chase::logs
