#include <gtest/gtest.h>

#include <cmath>

#include "services/simulator/attitude_loop.h"
#include "services/simulator/battery.h"
#include "services/simulator/imu.h"
#include "services/simulator/quadrotor.h"
#include "services/simulator/wind.h"

namespace chase::simulator {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kDt = 1e-3;
const Vector3d kStill = Vector3d::Zero();

double Flat(double, double) { return 0.0; }
double Abyss(double, double) { return -1e6; }

VehicleConfig Ideal() {
  VehicleConfig config;
  config.drag.setZero();
  config.thrust_error = 0.0;
  return config;
}

BodyState At(double z) {
  BodyState state;
  state.p.z() = z;
  return state;
}

Quaterniond Turn(double angle, const Vector3d& axis) {
  return Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}

TEST(Quadrotor, FallsAsGalileoSays) {
  Quadrotor quadrotor(Ideal(), At(100.0), Abyss);
  for (int i = 1; i <= 3000; ++i) {
    quadrotor.Step({}, kStill, kDt);
    const double t = i * kDt;
    ASSERT_NEAR(quadrotor.state().p.z(), 100.0 - 0.5 * kGravity * t * t, 1e-8);
    ASSERT_NEAR(quadrotor.state().v.z(), -kGravity * t, 1e-9);
  }
}

TEST(Quadrotor, ReachesTerminalVelocityUnderDrag) {
  VehicleConfig config = Ideal();
  config.drag = {0.3, 0.3, 0.3};
  Quadrotor quadrotor(config, At(100.0), Abyss);
  for (int i = 1; i <= 4000; ++i) quadrotor.Step({}, kStill, kDt);
  const double t = 4.0, v = -kGravity / 0.3 * (1.0 - std::exp(-0.3 * t));
  EXPECT_NEAR(quadrotor.state().v.z(), v, 0.01);
}

TEST(Quadrotor, DriftsWithTheWind) {
  VehicleConfig config = Ideal();
  config.drag = {0.5, 0.5, 0.5};
  Quadrotor quadrotor(config, At(100.0), Abyss);
  for (int i = 1; i <= 2000; ++i) quadrotor.Step({kGravity, kStill}, {2.0, -1.0, 0.0}, kDt);
  const double share = 1.0 - std::exp(-0.5 * 2.0);
  EXPECT_NEAR(quadrotor.state().v.x(), 2.0 * share, 2e-3);
  EXPECT_NEAR(quadrotor.state().v.y(), -1.0 * share, 2e-3);
}

TEST(Quadrotor, MotorsLagByTheirTimeConstant) {
  const VehicleConfig config = Ideal();
  Quadrotor quadrotor(config, At(100.0), Abyss);
  for (int i = 0; i < 30; ++i) quadrotor.Step({12.0, kStill}, kStill, kDt);
  const double thrust = quadrotor.motor_thrusts().sum() / config.mass;
  EXPECT_NEAR(thrust, 12.0 * (1.0 - std::exp(-0.030 / config.motor_lag)), 1e-9);
}

TEST(Quadrotor, ThrustModelErrorSinksAHover) {
  VehicleConfig config = Ideal();
  config.thrust_error = -0.02;
  Quadrotor quadrotor(config, At(100.0), Abyss);
  for (int i = 0; i < 1000; ++i) quadrotor.Step({kGravity, kStill}, kStill, kDt);
  EXPECT_NEAR(quadrotor.state().a.z(), -0.02 * kGravity, 1e-6);
}

TEST(Quadrotor, AHeavierBodySinksAndABentCurveGivesLess) {
  VehicleConfig heavy = Ideal();
  heavy.mass_error = 0.1;
  Quadrotor sinking(heavy, At(100.0), Abyss);
  VehicleConfig bent = Ideal();
  bent.thrust_curve = 0.2;
  Quadrotor weak(bent, At(100.0), Abyss), full(bent, At(100.0), Abyss);
  for (int i = 0; i < 1000; ++i) {
    sinking.Step({kGravity, kStill}, kStill, kDt);
    weak.Step({0.5 * bent.max_thrust, kStill}, kStill, kDt);
    full.Step({bent.max_thrust, kStill}, kStill, kDt);
  }
  EXPECT_NEAR(sinking.state().a.z(), kGravity / 1.1 - kGravity, 1e-6);
  EXPECT_NEAR(weak.state().a.z(), 0.9 * 0.5 * bent.max_thrust - kGravity, 1e-6);
  EXPECT_NEAR(full.state().a.z(), bent.max_thrust - kGravity, 1e-6);
}

TEST(Battery, ItsMotorsWeakenWithChargeAndLoad) {
  BatteryConfig config;
  EXPECT_EQ(Battery(config).ThrustShare(), 1.0) << "it does not sag by itself";
  config.sags = true;
  Battery full(config);
  full.Draw(1.0, kDt);
  EXPECT_NEAR(full.ThrustShare(), 1.0, 1e-6) << "at the hover";
  full.Draw(2.0, kDt);
  EXPECT_LT(full.ThrustShare(), 0.93);
  full.Draw(0.0, kDt);
  EXPECT_GT(full.ThrustShare(), 1.0);
  config.charge = 0.5;
  Battery half(config);
  half.Draw(1.0, kDt);
  EXPECT_NEAR(half.ThrustShare(), std::pow(15.0 / 16.4, 2), 1e-3);
  Quadrotor weak(Ideal(), At(100.0), Abyss);
  weak.SetSupply(half.ThrustShare());
  for (int i = 0; i < 1000; ++i) weak.Step({kGravity, kStill}, kStill, kDt);
  EXPECT_NEAR(weak.state().a.z(), (half.ThrustShare() - 1.0) * kGravity, 1e-6);
}

TEST(Quadrotor, TorqueTurnsAboutItsOwnAxis) {
  const VehicleConfig config = Ideal();
  for (int axis = 0; axis < 3; ++axis) {
    Quadrotor quadrotor(config, At(100.0), Abyss);
    const Vector3d torque = 0.02 * Vector3d::Unit(axis);
    for (int i = 0; i < 500; ++i) quadrotor.Step({kGravity, torque}, kStill, kDt);
    const double settled = 0.5 - config.motor_lag;  // s that the lag leaves
    const Vector3d expected = settled * torque.cwiseQuotient(config.inertia);
    EXPECT_NEAR((quadrotor.state().w - expected).norm(), 0.0, 0.03 * expected.norm()) << axis;
  }
}

TEST(Quadrotor, MotorsStayWithinTheirLimits) {
  const VehicleConfig config = Ideal();
  Quadrotor quadrotor(config, At(100.0), Abyss);
  for (int i = 0; i < 400; ++i) {
    quadrotor.Step({40.0 * (i % 3), {3.0, -4.0, 5.0}}, kStill, kDt);
    EXPECT_GE(quadrotor.motor_thrusts().minCoeff(), 0.0);
    EXPECT_LE(quadrotor.motor_thrusts().maxCoeff(), config.mass * config.max_thrust / 4.0 + 1e-9);
  }
}

TEST(Quadrotor, StandsStillOnItsLegs) {
  const VehicleConfig config;
  Quadrotor quadrotor(config, At(StandingHeight(config)), Flat);
  for (int i = 0; i < 5000; ++i) quadrotor.Step({}, kStill, kDt);
  EXPECT_TRUE(quadrotor.on_ground());
  EXPECT_NEAR(quadrotor.state().p.z(), StandingHeight(config), 1e-6);
  EXPECT_LT(quadrotor.state().v.norm() + quadrotor.state().w.norm(), 1e-6);
  EXPECT_LT(quadrotor.state().a.norm(), 1e-4);
}

TEST(Quadrotor, StandsOnASlope) {
  const VehicleConfig config = Ideal();
  const auto slope = [](double x, double) { return 0.2 * x; };
  Quadrotor quadrotor(config, At(StandingHeight(config) + 0.02), slope);
  for (int i = 0; i < 4000; ++i) quadrotor.Step({}, kStill, kDt);
  EXPECT_TRUE(quadrotor.on_ground());
  EXPECT_LT(quadrotor.state().v.norm(), 0.01);
  const Vector3d up = quadrotor.state().q * Vector3d::UnitZ();
  EXPECT_NEAR(std::atan2(-up.x(), up.z()), std::atan(0.2), 0.02);
}

TEST(Quadrotor, LandsFromAFallAndASlide) {
  const VehicleConfig config;
  BodyState state = At(0.4);
  state.v = {0.6, -0.3, -0.5};
  Quadrotor quadrotor(config, state, Flat);
  for (int i = 0; i < 4000; ++i) quadrotor.Step({}, kStill, kDt);
  EXPECT_NEAR(quadrotor.state().p.z(), StandingHeight(config), 1e-3);
  EXPECT_LT(quadrotor.state().v.norm(), 1e-3);
  EXPECT_GT((quadrotor.state().q * Vector3d::UnitZ()).z(), 0.999);
}

/// Flies the inner loop on the body for a while.
struct Flight {
  explicit Flight(const BodyState& start)
      : quadrotor(config, start, Abyss), loop(AttitudeLoopConfig{}, config.inertia) {}
  void Fly(const AttitudeSetpoint& setpoint, double duration) {
    for (int i = 0; i < static_cast<int>(duration / kDt); ++i)
      quadrotor.Step(loop.Step(setpoint, quadrotor.state(), false, kDt), kStill, kDt);
  }
  double ErrorTo(const Quaterniond& q) const { return quadrotor.state().q.angularDistance(q); }

  VehicleConfig config;
  Quadrotor quadrotor;
  AttitudeLoop loop;
};

TEST(AttitudeLoop, ReachesTheAttitudeFromDisturbedStarts) {
  world::Random random(3);
  for (int n = 0; n < 20; ++n) {
    BodyState start;
    start.q = Turn(random.Uniform(0.0, 2.5), {random.Gaussian(), random.Gaussian(), 0.3});
    start.w = {random.Gaussian(), random.Gaussian(), random.Gaussian()};
    Flight flight(start);
    AttitudeSetpoint setpoint;
    setpoint.thrust = 10.0;
    setpoint.orientation =
        Turn(random.Uniform(0.0, 0.6), {random.Gaussian(), random.Gaussian(), 0.0});
    flight.Fly(setpoint, 8.0);  // the yaw integral unwinds slowly
    EXPECT_LT(flight.ErrorTo(setpoint.orientation), 0.01) << n;
    EXPECT_LT(flight.quadrotor.state().w.norm(), 0.02) << n;
  }
}

TEST(AttitudeLoop, TiltStepRisesAsAWellDampedSecondOrder) {
  Flight flight(BodyState{});
  AttitudeSetpoint setpoint;
  setpoint.thrust = kGravity;
  setpoint.orientation = Turn(0.3, Vector3d::UnitY());
  double most = 0.0, rise = -1.0;
  for (int i = 0; i < 1000; ++i) {
    flight.Fly(setpoint, kDt);
    const Vector3d up = flight.quadrotor.state().q * Vector3d::UnitZ();
    const double tilt = std::asin(up.x());
    if (rise < 0.0 && tilt > 0.27) rise = i * kDt;
    most = std::max(most, tilt);
  }
  EXPECT_GT(rise, 0.1);
  EXPECT_LT(rise, 0.5);
  EXPECT_LT(most, 0.3 * 1.15);
}

/// A turning setpoint with its rate fed forward is followed with less lag than without.
TEST(AttitudeLoop, FeedForwardRemovesTheLag) {
  double error[2];
  for (int fed = 0; fed < 2; ++fed) {
    Flight flight(BodyState{});
    AttitudeSetpoint setpoint;
    setpoint.thrust = kGravity;
    setpoint.body_rate = fed ? Vector3d(0.0, 0.0, 0.8) : Vector3d::Zero();
    for (int i = 0; i < 3000; ++i) {
      setpoint.orientation = Turn(0.8 * i * kDt, Vector3d::UnitZ());
      flight.Fly(setpoint, kDt);
    }
    error[fed] = flight.ErrorTo(setpoint.orientation);
  }
  EXPECT_LT(error[1], 0.03);
  EXPECT_GT(error[0], 0.2);
}

TEST(Imu, ReadsGravityAtRestInAnyAttitude) {
  ImuConfig config;
  config.accel_bias = config.gyro_bias = config.accel_walk = config.gyro_walk = 0.0;
  Imu imu(config, 1);
  for (const double angle : {0.0, 0.4, -1.2, 3.0}) {
    BodyState state;
    state.q = Turn(angle, {1.0, 2.0, 0.5});
    Vector3d accel = Vector3d::Zero(), gyro = Vector3d::Zero();
    for (int i = 0; i < 4000; ++i) {
      const ImuSample sample = imu.Measure(state, 0.005);
      accel += sample.accel / 4000.0;
      gyro += sample.gyro / 4000.0;
    }
    EXPECT_LT((accel - state.q.conjugate() * Vector3d(0.0, 0.0, kGravity)).norm(), 0.002);
    EXPECT_LT(gyro.norm(), 0.0002);
  }
}

TEST(Imu, ReadsNothingInFreeFall) {
  ImuConfig config;
  config.accel_noise = config.accel_bias = config.accel_walk = 0.0;
  BodyState state;
  state.a = {0.0, 0.0, -kGravity};
  EXPECT_EQ(Imu(config, 1).Measure(state, 0.005).accel, Vector3d(0.0, 0.0, 0.0));
}

TEST(Imu, NoiseAndBiasHaveTheirSpreads) {
  const ImuConfig config;
  double bias = 0.0, noise = 0.0;
  constexpr int units = 400;
  for (int seed = 0; seed < units; ++seed) {
    Imu imu(config, static_cast<uint64_t>(seed));
    bias += imu.bias().gyro.squaredNorm() / (3.0 * units);
    const Vector3d sample = imu.Measure(BodyState{}, 0.0).gyro - imu.bias().gyro;
    noise += sample.squaredNorm() / (3.0 * units);
  }
  EXPECT_NEAR(std::sqrt(bias), config.gyro_bias, 0.1 * config.gyro_bias);
  EXPECT_NEAR(std::sqrt(noise), config.gyro_noise, 0.1 * config.gyro_noise);
}

TEST(Wind, GustsHaveTheirSpreadAndCorrelation) {
  world::WindSpec spec;
  spec.mean = {1.0, 0.0, 0.0};
  spec.gust = 0.7;
  spec.gust_time = 2.0;
  Wind wind(spec, 1);
  double mean = 0.0, variance = 0.0, lagged = 0.0, before = 0.0;
  constexpr int n = 400000;
  for (int i = 0; i < n; ++i) {
    wind.Step(0.5);
    const double x = wind.velocity().x() - 1.0;
    mean += x / n;
    variance += x * x / n;
    lagged += x * before / n;
    before = x;
  }
  EXPECT_NEAR(mean, 0.0, 0.02);
  EXPECT_NEAR(std::sqrt(variance), 0.7, 0.02);
  EXPECT_NEAR(lagged / variance, std::exp(-0.25), 0.01);
}

}  // namespace
}  // namespace chase::simulator
