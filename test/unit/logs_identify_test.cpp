#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>

#include "common/config/config.h"
#include "logs/src/identify.h"
#include "test/unit/logs_flown.h"
#include "test/unit/logs_small_log.h"

namespace chase::logs {
namespace {

using namespace testing;

/// A vehicle, its weather and its course, all drawn.
struct Drawn {
  Body body;
  Course course;
  Errors errors;
  double rate_share = 1.0;
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
  d.rate_share = random.Uniform() < 0.5 ? 0.0 : 1.0;
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
  /// `most`: of the root mean square error. `steps`: by which the body's own steps of 1 ms are off.
  void Add(const std::string& name, const Parameter& p, double truth, double most,
           double steps = 0.0) {
    Row& row = rows_[name];
    ++row.n;
    row.most = most;
    if (!std::isfinite(p.sigma)) return;
    const double error = std::abs(p.value - truth);
    ++row.observed;
    row.within += error <= 2.0 * p.sigma + steps;
    row.squares += error * error;
    row.claimed += p.sigma * p.sigma - p.systematic * p.systematic;
  }
  void Judge() const {
    for (const auto& [name, row] : rows_) {
      const double error = std::sqrt(row.squares / row.observed);
      const double claimed = std::sqrt(row.claimed / row.observed);
      std::printf("%-18s rms error %.4f, random %.4f, within two deviations %d of %d\n",
                  name.c_str(), error, claimed, row.within, row.observed);
      // 95 % of 24 flights: fewer than 20 come by chance once in 170 times.
      EXPECT_GE(row.within, 20 - (row.n - row.observed)) << name;
      EXPECT_GE(row.observed, 21) << name;
      EXPECT_LE(claimed, 2.0 * error) << name;
      EXPECT_LE(error, row.most) << name;
    }
  }

 private:
  struct Row {
    int n = 0, observed = 0, within = 0;
    double squares = 0.0, claimed = 0.0, most = 0.0;
  };
  std::map<std::string, Row> rows_;
};

TEST(Identify, ClaimsWhatItKnowsOfVehiclesInWind) {
  Tally tally;
  for (uint64_t seed = 1; seed <= 24; ++seed) {
    const Drawn d = Draw(seed);
    const auto found = Identify(Fly(d.body, d.course, d.errors, seed, 60.0, d.rate_share));
    ASSERT_TRUE(found) << seed;
    const double hover = HoverThrust(d.body), scale = 9.81 / hover;
    const double late = 1e-3 * d.body.latency_ms + 0.5 * kStep;  // a setpoint is held for a step
    tally.Add("drag horizontal", found->drag_horizontal, d.body.drag, 0.05);
    tally.Add("drag vertical", found->drag_vertical, d.body.drag, 0.06);
    tally.Add("hover thrust", found->hover_thrust, hover, 0.1);
    tally.Add("thrust scale", found->thrust_scale, scale, 0.01);
    tally.Add("thrust curvature", found->thrust_curvature,
              d.body.thrust_curve * hover / 9.81 / scale, 0.04);
    tally.Add("thrust lag", found->thrust_lag, d.body.thrust_time_constant + late, 0.006, 1e-3);
    const double step = 1e-3, gain = d.body.attitude_gain;
    tally.Add("attitude gain", found->attitude_gain, gain, 0.1, step * gain * gain);
    tally.Add("rates followed", found->rate_share, d.rate_share, 0.02, step * gain);
    tally.Add("rate lag", found->rate_lag, d.body.rate_time_constant + late, 0.002, step);
    tally.Add("lead", found->lead, late + (1.0 - d.rate_share) / gain, 0.002, step);
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
  EXPECT_NE(text.find("not observable, +- 0.045 is needed: level flight"), std::string::npos)
      << text;
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
}

TEST(Identify, LeavesControlsDragWhereItDoesNotKnowBetter) {
  Identification level;
  level.drag_horizontal = level.drag_forward = level.drag_sideways = {0.6, 0.01};
  level.drag_vertical = {0.9, 0.3};
  level.lead = {-0.004, 0.002};
  const std::string part = ControlFile(level, "level.lcm");
  EXPECT_EQ(part.find("drag"), std::string::npos) << part;
  control::ControlConfig config;
  config::LoadText(part, "written", &config);
  EXPECT_EQ(config.lead, 0.0) << "control takes none below 0";

  const std::string present = WriteText("control.yaml", "drag: [0.5, 0.4, 0.33]\n");
  const std::string text = ControlFile(level, "level.lcm", present);
  config::LoadText(text, "written", &config);
  EXPECT_EQ(config.drag, Vector3d(0.6, 0.6, 0.33)) << text;
  level.drag_sideways.sigma = 0.2;  // flown nose first
  EXPECT_EQ(ControlFile(level, "level.lcm", present).find("drag"), std::string::npos);
  level.drag_sideways.sigma = 0.01;
  std::swap(level.drag_horizontal, level.drag_vertical);
  config::LoadText(ControlFile(level, "climb.lcm", present), "written", &config);
  EXPECT_EQ(config.drag, Vector3d(0.5, 0.4, 0.6));
}

TEST(Identify, SaysWhereALongerFlightWouldNotHelp) {
  Identification i;
  i.seconds = 30.0;
  i.drag_forward = {0.3, 0.09, 0.0}, i.drag_sideways = {0.3, 0.09, 0.06};
  const std::string text = Format(i);
  EXPECT_NE(text.find("level flight nose first, 2.0 times as strong or for 120 s\n"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("level flight sideways; however long it is, +- 0.06 is left\n"),
            std::string::npos)
      << text;
}

TEST(Identify, FlightsWithoutThrustOrSpeedShowNothing) {
  for (const double thrust : {0.0, 9.81}) {
    FlightSamples still;
    Motion motion;
    motion.accel.z() = 9.81;
    Asked asked;
    asked.thrust = thrust;
    for (; motion.t < 10.0; motion.t = asked.t += kStep) {
      still.motions.push_back(motion);
      still.asked.push_back(asked);
    }
    const auto found = Identify(still);
    ASSERT_TRUE(found);
    EXPECT_EQ(Format(*found).find("nan"), std::string::npos) << Format(*found);
    for (const Parameter& drag :
         {found->drag_forward, found->drag_horizontal, found->drag_vertical})
      EXPECT_TRUE(std::isinf(drag.sigma)) << thrust;
    EXPECT_EQ(std::isinf(found->hover_thrust.sigma), thrust == 0.0);
    EXPECT_EQ(ControlFile(*found, "still.lcm"), "");
  }
}

}  // namespace
}  // namespace chase::logs
