#include <gtest/gtest.h>

#include <cmath>

#include "common/math/rotation.h"
#include "services/odometry/error_state_filter.h"
#include "services/odometry/scan_matcher.h"
#include "test/unit/odometry_synthetic.h"

// The error-state filter: motion by inertia, what a match makes of it, and biases that jump.

namespace chase::odometry {
namespace {

using test::Flight;
using test::Noise;
using test::SensorModel;

TEST(Filter, GoesBackTheWayItCame) {
  Noise noise(12);
  for (int trial = 0; trial < 20; ++trial) {
    NavState start;
    start.v = noise.Vector(2.0);
    start.R_WB = math::ExpSO3(noise.Vector(0.5));
    NavState state = start;
    const Eigen::Vector3d accel = noise.Vector(3.0), gyro = noise.Vector(1.0);
    for (int i = 1; i <= 100; ++i) Propagate(FilterConfig{}, {0.005 * i, accel, gyro}, &state);
    for (int i = 99; i >= 0; --i) Propagate(FilterConfig{}, {0.005 * i, accel, gyro}, &state);
    EXPECT_LT((state.p - start.p).norm(), 1e-9);
    EXPECT_LT((state.v - start.v).norm(), 1e-9);
    EXPECT_LT(math::LogSO3(state.R_WB * start.R_WB.conjugate()).norm(), 1e-9);
    EXPECT_GT(state.P(kV, kV), 0.0);
  }
}

/// A force or rate that changes at once, some time between two samples, against what their mean
/// makes of it.
TEST(Filter, WhatPassesBetweenSamplesIsDoubted) {
  constexpr double dt = 0.005;
  Noise noise(13);
  const ImuSample from{0.0, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  const ImuSample to{dt, noise.Vector(30.0), noise.Vector(3.0)};
  NavState state;
  AddUnsampled(FilterConfig{}, from, to, dt, &state);
  double v2 = 0.0, theta2 = 0.0;
  constexpr int n = 10000;
  for (int i = 0; i < n; ++i) {
    const double after = (i + 0.5) / n - 0.5;  // share of dt beyond the middle
    v2 += std::pow(after * dt, 2) * to.accel.squaredNorm() / n;
    theta2 += std::pow(after * dt, 2) * to.gyro.squaredNorm() / n;
  }
  EXPECT_NEAR((state.P.block<3, 3>(kV, kV).trace()) / v2, 1.0, 0.02);
  EXPECT_NEAR((state.P.block<3, 3>(kTheta, kTheta).trace()) / theta2, 1.0, 0.02);
  NavState quiet;
  AddUnsampled(FilterConfig{}, from, {dt, {0.02, 0.01, 0.0}, {0.002, 0.0, 0.001}}, dt, &quiet);
  EXPECT_EQ(quiet.P.norm(), 0.0);  // that is noise
}

TEST(ErrorStateFilter, CovarianceFollowsTheNonlinearMotion) {
  FilterConfig quiet;
  quiet.gyro_noise = quiet.accel_noise = quiet.gyro_bias_walk = quiet.accel_bias_walk = 0.0;
  Noise noise(5);
  for (int trial = 0; trial < 20; ++trial) {
    NavState state;
    state.R_WB = math::ExpSO3(noise.Vector(1.0));
    state.v = noise.Vector(2.0);
    ErrorVector dx;
    for (int i = 0; i < kStates; ++i) dx[i] = noise.Gauss(1e-5);
    NavState other = state;
    Inject(dx, &other);
    state.P = dx * dx.transpose();
    const ImuSample imu{0.005, noise.Vector(5.0), noise.Vector(1.0)};
    Propagate(quiet, imu, &state);
    Propagate(quiet, imu, &other);
    ErrorVector moved = dx;
    moved.segment<3>(kP) = other.p - state.p;
    moved.segment<3>(kV) = other.v - state.v;
    moved.segment<3>(kTheta) = math::LogSO3(other.R_WB * state.R_WB.conjugate());
    const ErrorCovariance expected = moved * moved.transpose();
    EXPECT_LT((state.P - expected).norm(), 2e-3 * expected.norm()) << "trial " << trial;
  }
}

TEST(ErrorStateFilter, InertialMotionFollowsAnAnalyticFlight) {
  const Flight flight = Flight::Aggressive();
  SensorModel perfect;
  perfect.gyro_noise = perfect.accel_noise = 0.0;
  perfect.gyro_bias.setZero();
  perfect.accel_bias.setZero();
  Noise noise(6);
  NavState state;
  state.t = 4.0;
  state.p = flight.X_WB(4.0).p;
  state.R_WB = flight.X_WB(4.0).R;
  state.v = flight.Velocity(4.0);
  for (int i = 1; i <= 400; ++i) {
    ImuSample imu = test::Measure(flight, 4.0 + 0.005 * i - 0.0025, perfect, &noise);
    imu.t += 0.0025;  // the middle of the interval stands for all of it
    Propagate(FilterConfig{}, imu, &state);
  }
  EXPECT_LT((state.p - flight.X_WB(6.0).p).norm(), 5e-3);
  EXPECT_LT((state.v - flight.Velocity(6.0)).norm(), 5e-3);
}

TEST(ErrorStateFilter, UpdateLeavesUnknownDirectionsAlone) {
  NavState state;
  state.P = 0.01 * ErrorCovariance::Identity();
  PoseMeasurement z;
  z.X_WB.p = {0.1, 0.1, 0.1};
  z.known = Eigen::MatrixXd::Zero(6, 5);
  for (int i = 0; i < 5; ++i) z.known(i < 1 ? 0 : i + 1, i) = 1.0;  // all but y
  z.information = 1e4 * Eigen::Matrix<double, 6, 6>::Identity();
  const UpdateResult result = Update(FilterConfig{}, z, 0.1, &state);
  EXPECT_TRUE(result.applied);
  EXPECT_NEAR(state.p.y(), 0.0, 1e-12);
  EXPECT_GT(state.p.x(), 0.09);
  EXPECT_NEAR(state.P(1, 1), 0.01, 1e-12);
  EXPECT_LT(state.P(0, 0), 0.001);
}

/// Where no sweep holds the place, a map that is not quite level turns into a velocity, for ever.
TEST(ErrorStateFilter, UnheldAccelerationIsNeverKnownBetterThanTheMapIsLevel) {
  FilterConfig config;
  config.gyro_noise = config.accel_noise = config.gyro_bias_walk = config.accel_bias_walk = 0.0;
  NavState state;
  state.P = 1e-12 * ErrorCovariance::Identity();
  const Eigen::Matrix3d along_x = Eigen::Vector3d::UnitX() * Eigen::RowVector3d::UnitX();
  for (int i = 1; i <= 2000; ++i) {
    Propagate(config, {0.005 * i, {0.0, 0.0, 9.81}, Eigen::Vector3d::Zero()}, &state);
    if (i % 20 == 0) DoubtAcceleration(config, along_x, &state);
  }
  const double expected = 0.5 * config.map_tilt * config.gravity * 100.0;  // after ten seconds
  EXPECT_GT(std::sqrt(state.P(kP, kP)), 0.9 * expected);
  EXPECT_LT(std::sqrt(state.P(kP, kP)), 1.1 * expected);
  EXPECT_LT(std::sqrt(state.P(kP + 1, kP + 1)), 0.01 * expected);
}

/// An error along an unknown direction moves what is known as far as the match couples them.
TEST(ErrorStateFilter, UnknownDirectionsBlurTheKnownOnesTheyAreCoupledTo) {
  NavState state;
  state.P = 1e-6 * ErrorCovariance::Identity();
  state.P(kP + 1, kP + 1) = 1.0;  // m^2, along y
  PoseMeasurement z{Pose{}, Eigen::MatrixXd::Zero(6, 5),
                    1e6 * Eigen::Matrix<double, 6, 6>::Identity()};
  for (int i = 0; i < 5; ++i) z.known(i < 1 ? 0 : i + 1, i) = 1.0;  // all but y
  NavState coupled = state;
  ASSERT_TRUE(Update(FilterConfig{}, z, 0.1, &state).applied);
  z.information(0, 1) = z.information(1, 0) = 0.05e6;
  ASSERT_TRUE(Update(FilterConfig{}, z, 0.1, &coupled).applied);
  EXPECT_LT(std::sqrt(state.P(0, 0)), 8.2e-4);
  EXPECT_GT(std::sqrt(coupled.P(0, 0)), 9.5e-4);  // 0.05 m of blur tell nothing of x
}

/// A pose known to 1 cm and one measured to 1 mm that lies `off` from it [m].
struct Innovation {
  NavState state;
  PoseMeasurement z{Pose{}, Eigen::Matrix<double, 6, 6>::Identity(),
                    1e6 * Eigen::Matrix<double, 6, 6>::Identity()};
  explicit Innovation(double off) {
    state.P = 1e-4 * ErrorCovariance::Identity();
    z.X_WB.p.x() = off;
  }
};

TEST(ErrorStateFilter, AMatchAtOddsWithThePredictionCountsForLess) {
  Innovation usual(0.02), large(0.2);
  ASSERT_TRUE(Update(FilterConfig{}, usual.z, 0.1, &usual.state).applied);
  ASSERT_TRUE(Update(FilterConfig{}, large.z, 0.1, &large.state).applied);
  EXPECT_LT(std::sqrt(usual.state.P(0, 0)), 0.002);
  EXPECT_GT(usual.state.p.x(), 0.95 * 0.02);
  EXPECT_LT(large.state.p.x(), 0.97 * 0.2);
  EXPECT_GT(large.state.P(0, 0), 2.0 * usual.state.P(0, 0));
}

/// A match in another place, sweep after sweep, as by the other face of a wall: no accelerometer
/// that was right a tenth of a second ago can have moved the body there.
TEST(ErrorStateFilter, AMatchThatIsOffIsNotLearntAsABias) {
  for (const int missed : {0, 2}) {  // sweeps of no use before
    NavState state;
    state.P.diagonal() << Eigen::Vector3d::Constant(1e-6), Eigen::Vector3d::Constant(1e-5),
        Eigen::Vector3d::Constant(2.5e-7), Eigen::Vector3d::Constant(1e-7),
        Eigen::Vector3d::Constant(4e-4), Eigen::Vector3d::Constant(1e-6);
    std::optional<JumpHypothesis> jump;
    for (int sample = 1; sample <= 100; ++sample) {
      const ImuSample imu{0.005 * sample, {0.0, 0.0, 9.81}, Eigen::Vector3d::Zero()};
      Propagate(FilterConfig{}, imu, &state);
      if (jump) Propagate(FilterConfig{}, imu, &jump->state);
      if (sample % 20 != 0 || sample <= 20 * missed) continue;
      PoseMeasurement z{Pose{}, Eigen::Matrix<double, 6, 6>::Identity(),
                        1e6 * Eigen::Matrix<double, 6, 6>::Identity(), MatchConfig{}.least_gate};
      z.X_WB.p.x() = 0.1 + 0.1 * state.t;
      const UpdateResult result = Update(FilterConfig{}, z, state.t, &state, &jump);
      EXPECT_FALSE(result.applied) << "at " << state.t << " s";
    }
    EXPECT_LT(state.accel_bias.norm(), 0.05) << missed << " missed";
    EXPECT_LT(state.v.norm(), 0.05) << missed << " missed";
  }
}

/// A state that has flown for a while, level and at rest, with poses known to a millimetre at 10
/// Hz.
struct Settled {
  NavState state;
  std::optional<JumpHypothesis> jump;
  Noise noise{3};

  Settled() {
    state.P.diagonal() << Eigen::Vector3d::Constant(1e-6), Eigen::Vector3d::Constant(1e-5),
        Eigen::Vector3d::Constant(2.5e-7), Eigen::Vector3d::Constant(1e-7),
        Eigen::Vector3d::Constant(4e-4), Eigen::Vector3d::Constant(1e-6);
    for (int i = 0; i < 50; ++i) Match(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  }
  /// The match of a tenth of a second later is `off` [m]; the accelerometer reads `bias` too much.
  void Match(const Eigen::Vector3d& off, const Eigen::Vector3d& bias) {
    for (int i = 0; i < 20; ++i) {
      const ImuSample imu{state.t + 0.005, Eigen::Vector3d(0.0, 0.0, FilterConfig{}.gravity) + bias,
                          Eigen::Vector3d::Zero()};
      Propagate(FilterConfig{}, imu, &state);
      if (jump) Propagate(FilterConfig{}, imu, &jump->state);
    }
    PoseMeasurement z{Pose{}, Eigen::Matrix<double, 6, 6>::Identity(),
                      2e6 * Eigen::Matrix<double, 6, 6>::Identity(), MatchConfig{}.least_gate};
    z.information.bottomRightCorner<3, 3>() *= 16.0;
    z.X_WB.p = off + noise.Vector(7e-4);
    Update(FilterConfig{}, z, 0.1, &state, &jump);
  }
};

TEST(ErrorStateFilter, AMatchThatIsACentimetreOffIsNoJump) {
  for (const int n : {1, 2})
    for (double off = 0.004; off < 0.02; off += 0.001)
      for (int axis = 0; axis < 3; ++axis) {
        Settled flight;
        const Eigen::Vector3d wrong = off * Eigen::Vector3d::Unit(axis);
        for (int i = 0; i < n; ++i) flight.Match(wrong, Eigen::Vector3d::Zero());
        double fastest = 0.0;
        for (int i = 0; i < 20; ++i) {
          flight.Match(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
          fastest = std::max(fastest, flight.state.v.norm());
        }
        EXPECT_LT(fastest, 0.08) << n << " of " << off << " m along " << axis;
        EXPECT_LT(flight.state.accel_bias.norm(), 0.1) << n << " of " << off << " m along " << axis;
      }
}

TEST(ErrorStateFilter, AJumpAlongOneAxisIsLearnt) {
  for (const double jump : {0.25, 0.5})
    for (int axis = 0; axis < 3; ++axis) {
      Settled flight;
      const Eigen::Vector3d bias = jump * Eigen::Vector3d::Unit(axis);
      double farthest = 0.0;
      for (int i = 0; i < 30; ++i) {
        flight.Match(Eigen::Vector3d::Zero(), bias);
        farthest = std::max(farthest, flight.state.p.norm());
      }
      EXPECT_LT(farthest, 0.05) << jump << " along " << axis;
      EXPECT_LT(flight.state.v.norm(), 0.02) << jump << " along " << axis;
      EXPECT_LT((flight.state.accel_bias - bias).norm(), 0.1) << jump << " along " << axis;
    }
}

TEST(ErrorStateFilter, ImpossibleInnovationIsRefused) {
  Innovation innovation(0.5);
  const UpdateResult result = Update(FilterConfig{}, innovation.z, 0.1, &innovation.state);
  EXPECT_FALSE(result.applied);
  EXPECT_GT(result.nis, FilterConfig{}.largest_nis);
  EXPECT_EQ(innovation.state.p, Eigen::Vector3d::Zero());
}

TEST(ErrorStateFilter, UpdateWithoutInformationIsRefused) {
  NavState state;
  PoseMeasurement z;
  z.known = Eigen::MatrixXd::Identity(6, 6);
  z.information.setZero();
  EXPECT_FALSE(Update(FilterConfig{}, z, 0.1, &state).applied);
  EXPECT_TRUE(state.p.allFinite());
}

/// Without IMU the poses alone give the velocity; exact ones must not make it swing for ever.
TEST(ErrorStateFilter, VelocityFromExactPosesSettles) {
  const FilterConfig config;
  NavState state;
  state.P.diagonal().segment<3>(kV).setConstant(100.0);
  PoseMeasurement z{Pose{}, Eigen::Matrix<double, 6, 6>::Identity(),
                    1e12 * Eigen::Matrix<double, 6, 6>::Identity()};
  for (int i = 1; i <= 60; ++i) {
    z.X_WB.p.x() += 0.1 * (i <= 40 ? 1.0 : 2.0);
    PropagateBlind(config, 0.1 * i, &state);
    ASSERT_TRUE(Update(config, z, 0.1, &state).applied) << i;
    if (i == 40) {
      EXPECT_NEAR(state.v.x(), 1.0, 1e-3);
    }
  }
  EXPECT_NEAR(state.v.x(), 2.0, 1e-3);
}

TEST(ErrorStateFilter, DoubtOpensTheCovarianceForAConstantError) {
  const FilterConfig config;
  NavState state;
  state.P.setIdentity();
  state.P *= 1e-8;
  constexpr double kGap = 2.0;
  Doubt(config, kGap, &state);
  const double e = 0.5 * config.doubt_accel * kGap * kGap;
  EXPECT_GT(9.0 * state.P(kP, kP), e * e);
  EXPECT_GT(9.0 * state.P(kV, kV), std::pow(config.doubt_accel * kGap, 2));
  EXPECT_GT(state.P.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), 0.0);
}

}  // namespace
}  // namespace chase::odometry
