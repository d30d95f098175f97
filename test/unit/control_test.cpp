#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/config/config.h"
#include "common/math/rotation.h"
#include "logs/src/identify.h"
#include "services/control/controller.h"
#include "test/unit/control_body.h"

namespace chase::control {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using test::Body;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kStep = 0.005;  // s

/// Taylor polynomial of degree 11 of a circle of 2 m radius at 2 m/s (omega = 1 rad/s), 1 m up,
/// about `start`, nose along the way; exact to 1e-6 m over 1.2 s.
Plan CirclePlan(double start, double duration = 1.2) {
  Plan plan;
  plan.position = {start, duration, Eigen::MatrixXd::Zero(12, 3)};
  double factor = 2.0;  // radius omega^k T^k / k!
  for (int k = 0; k < 12; ++k) {
    plan.position.coefficients(k, 0) = factor * std::cos(start + k * M_PI / 2);
    plan.position.coefficients(k, 1) = factor * std::sin(start + k * M_PI / 2);
    factor *= duration / (k + 1);
  }
  plan.position.coefficients(0, 2) = 1.0;
  plan.yaw = Eigen::Vector2d(start + M_PI / 2, duration);
  return plan;
}

Plan PointPlan(const Vector3d& p, double start = 0.0) {
  return {world::Trajectory::Constant(p, start, 1.0), Eigen::VectorXd::Zero(1), {}};
}

Body OnCircle() {
  Body body;
  body.p = {2, 0, 1};
  body.v = {0, 2, 0};
  body.q = math::FromYaw(M_PI / 2);
  return body;
}

/// Root mean square and largest distance from the circle's moving point between `from` and `to`.
struct Error {
  double rms = 0.0, peak = 0.0;
};

/// What a log of the flight would hold.
void Record(double t, const Body& body, const Setpoint& asked, logs::FlightSamples* flight) {
  const Vector3d force = body.q.conjugate() * (body.a + Vector3d(0, 0, 9.81));
  flight->motions.push_back({t, force, body.w, body.v, body.q, Eigen::Matrix3d::Zero(), 0});
  flight->asked.push_back({t, asked.R_WB, asked.w_WB_B, asked.thrust});
}

Error FlyCircle(Body body, double from, double to, const ControlConfig& config = {},
                logs::FlightSamples* flight = nullptr) {
  Controller controller(config);
  double sum = 0.0;
  int n = 0;
  Error result;
  for (int i = 0; i * kStep < to; ++i) {
    const double t = i * kStep;
    if (i % 8 == 0) controller.AddPlan(CirclePlan(t));  // a plan every 40 ms
    const auto setpoint = controller.Update(t, body.Measured(), Health::kUsable);
    if (flight != nullptr) Record(t, body, *setpoint, flight);
    body.Step(*setpoint);
    const Vector3d wanted(2 * std::cos(t + kStep), 2 * std::sin(t + kStep), 1.0);
    if (t < from) continue;
    const double error = (body.p - wanted).norm();
    sum += error * error;
    result.peak = std::max(result.peak, error);
    ++n;
  }
  result.rms = std::sqrt(sum / n);
  return result;
}

void Report(const char* what, const Error& e) {
  std::printf("circle 2 m, 2 m/s, %-34s rms %.3f m, peak %.3f m\n", what, e.rms, e.peak);
}

TEST(ControlLoop, FliesCircle) {
  const Error e = FlyCircle(OnCircle(), 3.0, 20.0);
  Report("nothing wrong:", e);
  EXPECT_LT(e.rms, 0.03);
}

TEST(ControlLoop, FliesCircleLate) {
  Body body = OnCircle();
  body.latency_ms = 20;
  const Error e = FlyCircle(body, 3.0, 20.0);
  Report("20 ms late:", e);
  EXPECT_LT(e.rms, 0.05);
}

TEST(ControlLoop, LearnsTheDragThatItWasNotTold) {
  ControlConfig untold;
  untold.drag.setZero();
  const Error e = FlyCircle(OnCircle(), 3.0, 20.0, untold);
  Report("drag not told:", e);
  EXPECT_LT(e.rms, 0.03);
}

TEST(ControlLoop, FliesCircleInWindWithWrongMass) {
  Body body = OnCircle();
  body.wind = {3.0, 1.0, 0.0};
  body.mass_factor = 1.05;
  body.latency_ms = 20;
  const Error e = FlyCircle(body, 5.0, 25.0);
  Report("wind 3 m/s, mass +5 %, 20 ms:", e);
  EXPECT_LT(e.rms, 0.06);
  EXPECT_LT(e.peak, 0.12);
}

// The controller's own figures, then what its first flight told of the vehicle.
TEST(ControlLoop, FliesCircleByWhatTheFirstOneTold) {
  Body body = OnCircle();
  body.drag = 1.0;
  body.thrust_error = -0.1, body.thrust_curve = 0.1;
  logs::FlightSamples flight;
  const Error before = FlyCircle(body, 3.0, 20.0, {}, &flight);
  Report("drag 1 /s, thrust -10 %:", before);
  const auto found = logs::Identify(flight);
  ASSERT_TRUE(found);
  ControlConfig identified;
  config::LoadText(logs::ControlFile(*found, "the first circle"), "identified", &identified);
  const Error after = FlyCircle(body, 3.0, 20.0, identified);
  Report("the same, identified:", after);
  EXPECT_LE(before.rms, 0.15);
  EXPECT_LE(after.rms, 0.08);
  EXPECT_GT(before.rms, 2.0 * after.rms) << "nothing to identify";
}

TEST(ControlLoop, ErrorBoundHoldsForTheHalfSecondToCome) {
  for (const double wind : {0.0, 3.0}) {
    Body body = OnCircle();
    body.wind = {wind, 0.0, 0.0};
    body.mass_factor = 1.02;
    body.latency_ms = 20;
    Controller controller(ControlConfig{});
    std::vector<double> errors, bounds;
    for (int i = 0; i * kStep < 60.0; ++i) {
      const double t = i * kStep;
      if (i % 8 == 0) controller.AddPlan(CirclePlan(t));
      body.wind.x() = wind * (1.0 + 0.5 * std::sin(2.0 * t));
      body.Step(*controller.Update(t, body.Measured(), Health::kUsable));
      errors.push_back(controller.error().norm());
      bounds.push_back(controller.error_bound());
    }
    int held = 0, n = 0;
    for (size_t i = 400; i + 100 < errors.size(); ++i, ++n)
      held += *std::max_element(&errors[i], &errors[i] + 100) <= bounds[i];
    std::printf("bound holds for %.2f %% of %d half seconds, wind %.0f m/s\n", 100.0 * held / n, n,
                wind);
    EXPECT_GT(held, 0.99 * n) << wind;
  }
}

TEST(ErrorBound, IsTheTubeUntilTheErrorWasMeasured) {
  ErrorBound bound(0.12);
  EXPECT_NEAR(bound.value(), 0.12, 1e-12);
  double t = 0.0;
  const auto fly = [&](double s) {
    for (const double end = t + s; t < end; t += kStep) bound.Add(t, 0.02);
  };
  fly(1.0);
  EXPECT_NEAR(bound.value(), 0.12, 1e-12);
  fly(1.2);
  EXPECT_LT(bound.value(), 0.04);
  t += 1.0;
  fly(0.1);
  EXPECT_NEAR(bound.value(), 0.12, 1e-12);
}

TEST(ControlLoop, IntegralTakesOutMassErrorAtHover) {
  for (const double factor : {0.95, 1.05}) {
    Body body;
    body.mass_factor = factor;
    Controller controller(ControlConfig{});
    controller.AddPlan(PointPlan({0, 0, 0}));
    for (int i = 0; i < 2000; ++i)
      body.Step(*controller.Update(i * kStep, body.Measured(), Health::kUsable));
    EXPECT_LT(body.p.norm(), 0.01) << "mass factor " << factor;
  }
}

TEST(ControlLoop, RecoversFromDisturbedStarts) {
  struct Start {
    Vector3d dp, dv;
    double tilt;  // rad about a slanted axis
  };
  const Start starts[] = {{{1, 0, 0}, {0, 0, 0}, 0.0},   {{0, -3, 1}, {0, 0, 0}, 0.0},
                          {{0, 0, 0}, {-2, 2, 1}, 0.3},  {{0.5, 0.5, -0.5}, {0, -4, 0}, 0.6},
                          {{-8, 5, 2}, {1, 1, -1}, 0.0}, {{0, 0, 0}, {0, 0, 0}, 1.2}};
  for (const Start& start : starts) {
    Body body = OnCircle();
    body.latency_ms = 20;
    body.p += start.dp;
    body.v += start.dv;
    body.q = body.q * Quaterniond(Eigen::AngleAxisd(start.tilt, Vector3d(1, 1, 0).normalized()));
    EXPECT_LT(FlyCircle(body, 13.0, 17.0).peak, 0.06)
        << "from dp " << start.dp.transpose() << " dv " << start.dv.transpose() << " tilt "
        << start.tilt;
  }
}

TEST(ControlLoop, CatchUpSpeedBoundsApproach) {
  Body body;
  ControlConfig config;
  Controller controller(config);
  controller.AddPlan(PointPlan({12, 0, 0}));
  double fastest = 0.0;
  for (int i = 0; i < 3000; ++i) {
    body.Step(*controller.Update(i * kStep, body.Measured(), Health::kUsable));
    fastest = std::max(fastest, body.v.norm());
  }
  EXPECT_LT(fastest, config.catch_up_speed * 1.15);
  EXPECT_LT((body.p - Vector3d(12, 0, 0)).norm(), 0.05);
}

TEST(Controller, KeepsTiltAndThrustLimits) {
  const ControlConfig config;
  for (int i = 0; i < 400; ++i) {
    Controller controller(config);
    controller.AddPlan(PointPlan(Vector3d(std::sin(i), std::cos(2 * i), std::sin(3 * i)) * i));
    Estimate estimate;
    estimate.v_WB = Vector3d(std::cos(i), std::sin(5 * i), std::cos(7 * i)) * 0.1 * i;
    estimate.R_WB = math::ExpSO3(Vector3d(std::sin(11 * i), std::cos(13 * i), std::sin(17 * i)));
    const auto s = controller.Update(0.0, estimate, Health::kUsable);
    const double tilt = std::acos((s->R_WB * Vector3d::UnitZ()).z()) * 180.0 / M_PI;
    EXPECT_LE(tilt, config.tilt_limit_deg + 1e-6) << i;
    EXPECT_GE(s->thrust, config.min_thrust) << i;
    EXPECT_LE(s->thrust, config.max_thrust) << i;
    EXPECT_LE(s->w_WB_B.cwiseAbs().maxCoeff(), config.max_body_rate) << i;
    EXPECT_NEAR(s->R_WB.norm(), 1.0, 1e-9) << i;
  }
}

TEST(Controller, IsIdleWithoutPlan) {
  Controller controller(ControlConfig{});
  EXPECT_FALSE(controller.Update(0.0, {}, Health::kUsable));
  EXPECT_FALSE(controller.Update(0.1, {}, Health::kLost));
  EXPECT_EQ(controller.following(), Following::kNone);
  controller.AddPlan(PointPlan({0, 0, 1}, 0.5));
  EXPECT_FALSE(controller.Update(0.2, {}, Health::kUsable));
  EXPECT_TRUE(controller.Update(0.5, {}, Health::kUsable));
}

TEST(Controller, NeverSendsNaN) {
  const double bad[] = {kNaN, std::numeric_limits<double>::infinity(), 1e308, -1e308};
  for (const double value : bad) {
    for (int field = 0; field < 10; ++field) {
      Controller controller(ControlConfig{});
      controller.AddPlan(CirclePlan(0.0));
      Estimate e;
      controller.Update(0.0, e, Health::kUsable);
      (field < 3   ? e.p_WB[field]
       : field < 6 ? e.v_WB[field - 3]
                   : e.R_WB.coeffs()[field - 6]) = value;
      const auto s = controller.Update(0.005, e, Health::kUsable);
      ASSERT_TRUE(s);
      EXPECT_TRUE(s->R_WB.coeffs().allFinite() && s->w_WB_B.allFinite()) << field << " " << value;
      EXPECT_TRUE(std::isfinite(s->thrust)) << field << " " << value;
    }
  }
}

TEST(Controller, NeverSendsNaNForOverflowingPlan) {
  Controller controller(ControlConfig{});
  Plan plan = CirclePlan(0.0);
  controller.AddPlan(plan);
  controller.Update(0.0, {}, Health::kUsable);
  plan.position.start = 0.001;
  plan.position.coefficients.bottomRows(11).setConstant(1.7e308);
  controller.AddPlan(plan);
  const auto s = controller.Update(0.005, {}, Health::kUsable);
  ASSERT_TRUE(s);
  EXPECT_TRUE(s->R_WB.coeffs().allFinite() && s->w_WB_B.allFinite() && std::isfinite(s->thrust));
  EXPECT_EQ(controller.following(), Following::kBrake);
  controller.AddPlan(PointPlan({0, 0, 0}, 0.008));  // and a good plan mends it
  EXPECT_NEAR(controller.Update(0.010, {}, Health::kUsable)->thrust, 9.81, 0.5);
  EXPECT_EQ(controller.following(), Following::kPlan);
}

TEST(Controller, BrakesWhenTimeJumpsBackUntilAPlanOfThatTimeComes) {
  for (const double t : {3.0, 99.6})
    for (const Health health : {Health::kUsable, Health::kStarting, Health::kLost}) {
      Controller controller(ControlConfig{});
      controller.AddPlan(PointPlan({0, 0, 1}, 100.0));
      ASSERT_TRUE(controller.Update(100.0, {}, Health::kUsable));
      Estimate moves;
      moves.v_WB.x() = 1.0;
      const auto setpoint = controller.Update(t, moves, health);
      ASSERT_TRUE(setpoint) << "a body in the air";
      EXPECT_EQ(controller.following(), Following::kBrake) << t;
      if (health == Health::kUsable) {
        EXPECT_LT((setpoint->R_WB * Eigen::Vector3d::UnitZ()).x(), -0.05);
      }
      EXPECT_EQ(controller.AddPlan(PointPlan({0, 0, 0}, t)), "");
      EXPECT_TRUE(controller.Update(t + 0.005, {}, Health::kUsable));
      EXPECT_EQ(controller.following(), Following::kPlan);
    }
}

TEST(Controller, MotorsThatWereCutStayOffWhenTimeJumpsBack) {
  Controller controller(ControlConfig{});
  controller.AddPlan(PointPlan({0, 0, 1}, 100.0));
  ASSERT_TRUE(controller.Update(100.0, {}, Health::kUsable));
  controller.Cut();
  controller.Update(3.0, {}, Health::kUsable);
  controller.AddPlan(PointPlan({0, 0, 1}, 3.0));
  const auto setpoint = controller.Update(3.005, {}, Health::kUsable);
  ASSERT_TRUE(setpoint);
  EXPECT_FALSE(setpoint->motors);
}

TEST(ControlConfig, NamesFieldValueAndLimit) {
  EXPECT_EQ(ControlConfig{}.Problem(), "");
  ControlConfig config;
  config.tilt_limit_deg = 95.0;
  EXPECT_EQ(config.Problem(), "tilt_limit_deg is 95, must be from 1 to 60");
  config = {};
  config.lead = kNaN;
  EXPECT_NE(config.Problem().find("lead"), std::string::npos);
  config = {};
  config.position_gain.y() = 2.0;
  config.integral_gain.y() = 19.0;  // unstable by Routh although within its own range
  EXPECT_NE(config.Problem().find("integral_gain"), std::string::npos);
}

}  // namespace
}  // namespace chase::control
