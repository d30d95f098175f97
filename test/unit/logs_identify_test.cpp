#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/tracking_t.hpp"
#include "common/bus/convert.h"
#include "common/config/config.h"
#include "common/math/rotation.h"
#include "common/world/random.h"
#include "logs/src/flight_samples.h"
#include "logs/src/identify.h"
#include "services/control/tracking_law.h"
#include "test/unit/control_body.h"
#include "test/unit/logs_small_log.h"

namespace chase::logs {
namespace {

using control::test::Body;
using Eigen::Vector3d;
using world::Random;

constexpr double kStep = 0.005;  // s

/// A sum of two slow waves on each axis, so that velocity comes in all directions.
struct Course {
  Vector3d amplitude = {1.5, 1.2, 0.4}, phase = Vector3d::Zero();  // m, rad
  Vector3d omega = {1.0, 0.7, 1.3};                                // rad/s
  double yaw_rate = 0.2;                                           // rad/s

  control::Reference At(double t) const {
    control::Reference r;
    const Vector3d angle = omega * t + phase;
    const Vector3d sine = angle.array().sin(), cosine = angle.array().cos();
    const Vector3d first = amplitude.cwiseProduct(omega), second = first.cwiseProduct(omega);
    r.state.p = amplitude.cwiseProduct(sine);
    r.state.v = first.cwiseProduct(cosine);
    r.state.a = -second.cwiseProduct(sine);
    r.state.j = -second.cwiseProduct(omega).cwiseProduct(cosine);
    r.yaw = math::WrapAngle(yaw_rate * t);
    r.yaw_rate = yaw_rate;
    return r;
  }
};

/// What the world and the sensors add.
struct Errors {
  double gust = 0.0;                               // m/s, of 2 s
  Vector3d accel_bias = Vector3d::Zero();          // m/s^2
  double accel = 0.0, gyro = 0.0, velocity = 0.0;  // m/s^2, rad/s, m/s
};

Vector3d Noise(double sigma, Random* random) {
  const double x = random->Gaussian(), y = random->Gaussian(), z = random->Gaussian();
  return sigma * Vector3d(x, y, z);
}

FlightSamples Fly(Body body, const Course& course, const Errors& errors, uint64_t seed,
                  double seconds = 60.0) {
  Random random(seed, 1);
  control::TrackingLaw law(control::ControlConfig{});
  const Vector3d wind = body.wind;
  Vector3d gust = Vector3d::Zero();
  FlightSamples flight;
  const control::Reference start = course.At(0.0);
  body.p = start.state.p, body.v = start.state.v;
  for (int i = 0; i * kStep < seconds; ++i) {
    const double t = i * kStep, keep = std::exp(-kStep / 2.0);
    gust = keep * gust + Noise(errors.gust * std::sqrt(1.0 - keep * keep), &random);
    body.wind = wind + gust;
    control::Estimate estimate = body.Measured();
    estimate.v_WB += Noise(errors.velocity, &random);
    const control::Setpoint s = law.Track(estimate, course.At(t), course.At(t + 0.02), kStep);
    const Vector3d force = body.q.conjugate() * (body.a + Vector3d(0, 0, 9.81));
    flight.motions.push_back({t, force + errors.accel_bias + Noise(errors.accel, &random),
                              body.w + Noise(errors.gyro, &random), estimate.v_WB, body.q,
                              errors.velocity, 0});
    flight.asked.push_back({t, s.R_WB, s.w_WB_B, s.thrust});
    body.Step(s);
  }
  return flight;
}

/// A vehicle, its weather and its course, all drawn.
struct Drawn {
  Body body;
  Course course;
  Errors errors;
};

Drawn Draw(uint64_t seed) {
  Random random(seed, 0);
  Drawn d;
  d.body.drag = random.Uniform(0.1, 1.0);
  d.body.wind = {random.Uniform(-3.0, 3.0), random.Uniform(-3.0, 3.0), 0.0};
  d.body.thrust_error = random.Uniform(-0.1, 0.1);
  d.body.thrust_curve = random.Uniform(-0.1, 0.1);
  d.body.latency_ms = static_cast<int>(random.Uniform(0.0, 30.0));
  d.body.attitude_gain = random.Uniform(5.0, 8.0);
  d.body.rate_time_constant = random.Uniform(0.03, 0.07);
  d.body.thrust_time_constant = random.Uniform(0.02, 0.06);
  d.course.phase = Noise(3.0, &random);
  d.course.yaw_rate = random.Uniform(-0.3, 0.3);
  d.errors.gust = random.Uniform(0.0, 0.6);
  d.errors.accel_bias = Noise(0.05, &random);
  d.errors.accel = 0.03, d.errors.gyro = 0.003, d.errors.velocity = 0.005;
  return d;
}

double HoverThrust(const Body& body) {
  double u = 9.81;
  for (int i = 0; i < 50; ++i)
    u = 9.81 / (1.0 + body.thrust_error + body.thrust_curve * (u / 9.81 - 1.0));
  return u;
}

/// How often an estimate lies within twice what it claims of the truth, and how far off it is.
class Tally {
 public:
  void Add(const std::string& name, const Parameter& p, double truth, double tolerance = 0.0) {
    Row& row = rows_[name];
    const double error = std::abs(p.value - truth);
    ++row.n;
    row.within += error <= 2.0 * p.sigma + tolerance;
    row.squares += error * error;
    row.claimed += p.sigma * p.sigma;
  }
  void Judge() const {
    for (const auto& [name, row] : rows_) {
      std::printf("%-18s rms error %.4f, claimed %.4f, within two deviations %d of %d\n",
                  name.c_str(), std::sqrt(row.squares / row.n), std::sqrt(row.claimed / row.n),
                  row.within, row.n);
      // 95 % of 24 flights: fewer than 20 come by chance once in 170 times.
      EXPECT_GE(row.within, 20) << name;
    }
  }

 private:
  struct Row {
    int n = 0, within = 0;
    double squares = 0.0, claimed = 0.0;
  };
  std::map<std::string, Row> rows_;
};

TEST(Identify, ClaimsWhatItKnowsOfVehiclesInWind) {
  Tally tally;
  for (uint64_t seed = 1; seed <= 24; ++seed) {
    const Drawn d = Draw(seed);
    const auto found = Identify(Fly(d.body, d.course, d.errors, seed));
    ASSERT_TRUE(found) << seed;
    const double hover = HoverThrust(d.body), scale = 9.81 / hover;
    const double late = 1e-3 * d.body.latency_ms + 0.5 * kStep;  // a setpoint is held for a step
    tally.Add("drag horizontal", found->drag_horizontal, d.body.drag);
    tally.Add("drag vertical", found->drag_vertical, d.body.drag);
    tally.Add("hover thrust", found->hover_thrust, hover);
    tally.Add("thrust scale", found->thrust_scale, scale);
    tally.Add("thrust curvature", found->thrust_curvature,
              d.body.thrust_curve * hover / 9.81 / scale);
    tally.Add("thrust lag", found->thrust_lag, d.body.thrust_time_constant + late, kStep);
    tally.Add("attitude gain", found->attitude_gain, d.body.attitude_gain, 0.05);
    tally.Add("rates followed", found->rate_share, 1.0, 0.01);
    tally.Add("rate lag", found->rate_lag, d.body.rate_time_constant + late, 2e-3);
    tally.Add("lead", found->lead, late, 1e-3);
  }
  tally.Judge();
}

TEST(Identify, SaysWhatAFlightDoesNotTell) {
  Course hover;
  hover.amplitude.setZero();
  Errors errors;
  errors.gust = 0.3, errors.accel = 0.03, errors.gyro = 0.003, errors.velocity = 0.005;
  const auto found = Identify(Fly(Body(), hover, errors, 1));
  ASSERT_TRUE(found);
  const std::string text = Format(*found);
  EXPECT_NE(text.find("drag, horizontal"), std::string::npos) << text;
  EXPECT_NE(text.find("not told, +- 0.045 is needed: level flight"), std::string::npos) << text;
  EXPECT_EQ(ControlFile(*found, "hover").find("drag"), std::string::npos);
  EXPECT_FALSE(Identify(Fly(Body(), hover, errors, 1, 5.0))) << "4.5 s without the first half";
  EXPECT_FALSE(Identify({}));
}

TEST(Identify, WritesWhatControlReads) {
  Body body;
  body.drag = 0.6;
  Errors errors;
  errors.accel = 0.03, errors.gyro = 0.003, errors.velocity = 0.005;
  const auto found = Identify(Fly(body, Course(), errors, 1));
  ASSERT_TRUE(found);
  control::ControlConfig config;
  const std::string text = ControlFile(*found, "level.lcm");
  config::LoadText(text, "written", &config);
  EXPECT_NEAR(config.drag.x(), 0.6, 0.02) << text;
  EXPECT_EQ(config.drag.x(), config.drag.y());
  EXPECT_NEAR(config.drag.z(), 0.6, 0.05) << text;
  EXPECT_NEAR(config.lead, 0.5 * kStep, 0.002);

  Identification level;
  level.drag_horizontal = {0.6, 0.01}, level.drag_vertical = {0.9, 0.3},
  level.lead = {-0.004, 0.002};
  config = {};
  const double vertical = config.drag.z();
  const std::string part = ControlFile(level, "level.lcm");
  config::LoadText(part, "written", &config);
  EXPECT_EQ(config.drag, Vector3d(0.6, 0.6, vertical)) << part;
  EXPECT_EQ(config.lead, 0.0) << "control takes none below 0";
  EXPECT_NE(part.find("z as control has it"), std::string::npos) << part;
}

/// The log of a flight, with biases that odometry knows of; the first and the last second are on
/// the ground and a landing.
std::string WriteFlight(const std::string& name, const FlightSamples& flight,
                        const std::string& left_out = "", const std::string& second = "") {
  const std::string file = testing::Temp(name);
  OutputLog log(file);
  const auto write = [&](int64_t utime, const std::string& channel, const auto& m) {
    if (channel != left_out) log.Write(utime, channel, m);
    if (channel == second) log.Write(utime, "OTHER_" + channel, m);
  };
  for (size_t i = 0; i < flight.motions.size(); ++i) {
    const Motion& motion = flight.motions[i];
    const Asked& asked = flight.asked[i];
    const int64_t utime = 1'000'000 + 5'000 * static_cast<int64_t>(i);
    imu_t imu{};
    pose_t pose{};
    attitude_setpoint_t setpoint{};
    tracking_t tracking{};
    imu.utime = pose.utime = setpoint.utime = tracking.utime = utime;
    pose.accel_bias[1] = 0.2, pose.gyro_bias[2] = -0.1;
    bus::Set(imu.accel, motion.accel + Vector3d(0.0, 0.2, 0.0));
    bus::Set(imu.gyro, motion.w_WB_B - Vector3d(0.0, 0.0, 0.1));
    bus::Set(pose.orientation, motion.R_WB);
    bus::Set(pose.vel, i < 200 ? Vector3d(0.0, 0.0, 0.0) : motion.v_WB);
    bus::Set(setpoint.orientation, asked.R_WB);
    bus::Set(setpoint.body_rate, asked.w_WB_B);
    setpoint.thrust = asked.thrust;
    setpoint.motors = attitude_setpoint_t::MOTORS_ON;
    tracking.following = i + 200 < flight.motions.size() ? tracking_t::PLAN : tracking_t::LAND;
    write(utime, "IMU", imu);
    write(utime, "POSE", pose);
    write(utime, "ATTITUDE_SETPOINT", setpoint);
    write(utime, "TRACKING", tracking);
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

TEST(ReadSamples, SaysWhatIsMissing) {
  const FlightSamples flown = Fly(Body(), Course(), {}, 1, 3.0);
  for (const std::string channel : {"IMU", "POSE", "ATTITUDE_SETPOINT", "TRACKING"}) {
    const std::string without = WriteFlight("without.lcm", flown, channel);
    EXPECT_EQ(testing::ErrorOf([&] { ReadSamples(without); }),
              without + ": holds no " + channel +
                  "; identify needs IMU, POSE, ATTITUDE_SETPOINT and TRACKING");
    const std::string two = WriteFlight("two.lcm", flown, "", channel);
    EXPECT_NE(testing::ErrorOf([&] { ReadSamples(two); }).find(channel + " of several vehicles"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace chase::logs
