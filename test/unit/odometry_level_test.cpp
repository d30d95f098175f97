#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "common/math/rotation.h"
#include "services/odometry/alignment.h"
#include "services/odometry/level_frame.h"
#include "services/odometry/map_drift.h"
#include "services/odometry/standing.h"
#include "test/unit/odometry_course.h"

namespace chase::odometry {
namespace {

using test::Course;
using test::CourseResult;
using test::Flight;
using test::Noise;

ImuSample AtRest(double t, const Eigen::Vector3d& bias, Noise* noise) {
  return {t, Eigen::Vector3d(0.0, 0.0, 9.81) + bias + noise->Vector(0.02), noise->Vector(0.002)};
}

NavState Aligned(const Eigen::Vector3d& bias, unsigned seed) {
  Alignment alignment(AlignmentConfig{});
  Noise noise(seed);
  for (int i = 0; !alignment.Complete(); ++i) alignment.Add(AtRest(0.005 * i, bias, &noise));
  return alignment.Result(FilterConfig{}, Eigen::Vector3d::Zero(), 0.0);
}

TEST(Alignment, TiltAndBiasAreOneUnknownAtRest) {
  const NavState state = Aligned({0.08, -0.05, 0.03}, 1);
  // Once the bias and the mounting are known, so is the tilt.
  Eigen::Matrix<double, 6, 6> known;
  known << state.P.block<3, 3>(kAccelBias, kAccelBias), state.P.block<3, 3>(kAccelBias, kMount),
      state.P.block<3, 3>(kMount, kAccelBias), state.P.block<3, 3>(kMount, kMount);
  for (int axis : {0, 1}) {
    Eigen::Matrix<double, 6, 1> shared;
    shared << state.P.block<3, 1>(kAccelBias, kGravity + axis),
        state.P.block<3, 1>(kMount, kGravity + axis);
    const double correlation = std::sqrt(shared.dot(known.ldlt().solve(shared)) /
                                         state.P(kGravity + axis, kGravity + axis));
    EXPECT_GT(correlation, 0.98) << "axis " << axis;
    EXPECT_LT(correlation, 1.0) << "axis " << axis;
  }
  // What the accelerometer shows is explained whichever way the two are split.
  const Eigen::Vector3d felt = state.R_WB.conjugate() * (-state.g) + state.accel_bias;
  EXPECT_LT((felt - Eigen::Vector3d(0.08, -0.05, 9.84)).norm(), 0.01);
  EXPECT_NEAR(state.accel_bias.z(), 0.03, 0.01);  // |g| is known
}

TEST(Alignment, SettlingBodyIsWaitedForAFlyingOneIsNot) {
  for (const double until : {0.2, 1e9}) {
    Alignment alignment(AlignmentConfig{});
    Noise noise(2);
    double t = 0.0;
    for (; !alignment.Complete(); t += 0.005) {
      ImuSample imu = AtRest(t, Eigen::Vector3d::Zero(), &noise);
      if (t < until) imu.gyro.x() += std::cos(20.0 * t);
      alignment.Add(imu);
    }
    EXPECT_EQ(alignment.AtRest(), until < 1.0);
    EXPECT_NEAR(t, until < 1.0 ? 0.7 : 0.5, 0.06);
  }
}

/// A body that slides and turns while it comes to rest, `t` s after power-on.
Pose Settling(double t) {
  const double x = std::min(1.0, t / 0.25), s = x * x * x * (10.0 + x * (-15.0 + 6.0 * x));
  return {math::FromYaw(0.7 + 0.03 * s) * math::ExpSO3(s * Eigen::Vector3d(0.03, -0.05, 0.0)),
          Eigen::Vector3d(1.0, 2.0, 0.1) + s * Eigen::Vector3d(0.02, -0.03, -0.005)};
}

ImuSample SettlingImu(double t, Noise* noise) {
  constexpr double h = 1e-4;
  const Pose before = Settling(t - h), now = Settling(t), after = Settling(t + h);
  const Eigen::Vector3d a = (before.p + after.p - 2.0 * now.p) / (h * h);
  return {t, now.R.conjugate() * (a + Eigen::Vector3d(0.0, 0.0, 9.81)) + noise->Vector(0.02),
          math::LogSO3(before.R.conjugate() * after.R) / (2.0 * h) +
              Eigen::Vector3d(0.004, -0.002, 0.003) + noise->Vector(0.002)};
}

TEST(Alignment, PlaceAndHeadingAreThoseOfPowerOnAndWhatItMovedSince) {
  double yaw2 = 0.0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Alignment alignment(AlignmentConfig{});
    Noise noise(seed);
    double t = 0.0;
    for (; !alignment.Complete(); t += 0.005) alignment.Add(SettlingImu(t, &noise));
    ASSERT_TRUE(alignment.AtRest()) << seed;
    const Pose truth = Settling(t);
    const NavState state = alignment.Result(FilterConfig{}, Settling(0.0).p, 0.7);
    EXPECT_LT((state.p - truth.p).norm(), 0.004) << seed;
    const Eigen::Vector3d error = math::LogSO3(state.R_WB * truth.R.conjugate());
    EXPECT_LT(error.norm(), 1e-3) << seed;
    yaw2 += 0.1 * error.z() * error.z();
  }
  EXPECT_LT(std::sqrt(yaw2), 3e-4);  // as the state's covariance says
}

TEST(LevelFrame, GravityIsDownAndTheStartStaysWhereItIs) {
  Noise noise(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Vector3d start = noise.Vector(5.0);
    LevelFrame level(start);
    NavState state;
    state.g += noise.Vector(0.5);
    level.Turn(state);
    EXPECT_LT((level.R_WM() * state.g.normalized() + Eigen::Vector3d::UnitZ()).norm(), 1e-12);
    EXPECT_LT((level.ToWorld(start) - start).norm(), 1e-12);
    EXPECT_LT(std::abs(math::LogSO3(level.R_WM()).z()), 1e-9);  // no heading is changed
  }
}

TEST(LevelFrame, CovarianceIsThatOfTheNonlinearMap) {
  Noise noise(4);
  for (int trial = 0; trial < 30; ++trial) {
    NavState state;
    state.p = noise.Vector(20.0);
    state.v = noise.Vector(2.0);
    state.R_WB = math::ExpSO3(noise.Vector(0.5));
    state.g += noise.Vector(0.05);
    ErrorVector dx;
    for (int i = 0; i < kStates; ++i) dx[i] = noise.Gauss(1e-6);
    NavState other = state;
    Inject(dx, &other);
    state.P = dx * dx.transpose();
    LevelFrame level(noise.Vector(1.0));
    level.BeginAt(math::ExpSO3(noise.Vector(0.3)));
    LevelFrame moved = level;
    level.Turn(state);
    moved.Turn(other);
    const Pose a = level.ToWorld(state), b = moved.ToWorld(other);
    Eigen::Matrix<double, 9, 1> e;
    e << b.p - a.p, moved.R_WM() * other.v - level.R_WM() * state.v,
        math::LogSO3(b.R * a.R.conjugate());
    const Eigen::Matrix<double, 9, 9> expected = e * e.transpose();
    EXPECT_LT((level.CovarianceInWorld(state) - expected).norm(), 0.02 * expected.norm()) << trial;
  }
}

/// Far from the start a wrong tilt is metres of error; the flight itself must mend it.
TEST(LevelFrame, FlightTellsTiltFromBias) {
  Course course;
  course.duration = 20.0;
  course.sensors.azimuths = 900;
  course.sensors.accel_bias = {0.09, -0.08, 0.02};  // 12 mrad
  course.flight.yaw_amplitude = 1.6;
  const CourseResult result = test::Fly(course, test::ConfigFor(course.flight));
  const auto tilt_at = [&](double t) {
    const auto& visit = result.visits[static_cast<size_t>(t / 0.005)].estimate;
    const Eigen::Vector3d error =
        math::LogSO3(visit.X_WB.R * course.flight.X_WB(visit.t).R.conjugate());
    return error.head<2>().norm();
  };
  EXPECT_GT(tilt_at(0.7), 0.008);
  EXPECT_LT(tilt_at(19.9), 0.003);
}

/// A LiDAR that sits other than its calibration says tilts the body, biases the accelerometer and
/// turns W until turns and accelerations tell how it sits.
TEST(LevelFrame, FlightTellsHowTheLidarIsMounted) {
  Course course;
  course.duration = 40.0;
  course.sensors.azimuths = 900;
  course.flight = test::Flight::Aggressive();
  course.mount_error = {-0.004, 0.005, -0.006};
  OdometryConfig config = test::ConfigFor(course.flight);
  config.filter.mount_sigma = 0.005;
  const CourseResult result = test::Fly(course, config);
  const auto& last = result.visits.back().estimate;
  const Pose truth = course.flight.X_WB(last.t);
  EXPECT_LT(math::LogSO3(last.X_WB.R * truth.R.conjugate()).norm(), 0.001);
  EXPECT_LT((last.accel_bias - course.sensors.accel_bias).norm(), 0.01);
  // W turns about its vertical at the start: what is seen tells by how much.
  const Pose lidar{math::ExpSO3(course.mount_error), config.rig.lidar_position};
  const Eigen::Quaterniond seen = result.sweeps.back().X_WL.R;
  const Eigen::Quaterniond there = course.flight.X_WB(result.sweeps.back().t).R * lidar.R;
  EXPECT_LT(math::LogSO3(seen * there.conjugate()).norm(), 0.0015);
}

TEST(Standing, EndsWithTheFirstMotionAndOnlyThen) {
  Noise noise(5);
  Standing standing;
  ImuSample mean;
  mean.accel.z() = 9.81;
  standing.Begin(mean, 0.02, 0.002, Eigen::Vector3d::Zero());
  double t = 0.0;
  for (; t < 30.0; t += 0.005) standing.Add(AtRest(t, Eigen::Vector3d::Zero(), &noise), {});
  EXPECT_TRUE(standing.holds());
  const double lift = t;
  for (; t < lift + 0.25; t += 0.005)
    standing.Add(AtRest(t, {0.0, 0.0, 0.9 * (t - lift)}, &noise), {});
  EXPECT_FALSE(standing.holds());
  standing.Begin(mean, 0.02, 0.002, Eigen::Vector3d::Zero());
  standing.See({0.0, 0.3, 0.0});  // carried without being felt
  EXPECT_FALSE(standing.holds());
}

TEST(Standing, BeginsAgainAfterLandingAndNotInAHover) {
  Noise noise(6);
  Standing standing;
  double t = 0.0;
  const auto feel = [&](double until, double sway) {  // sway: of the felt force, m/s^2
    for (; t < until; t += 0.005)
      standing.Add(AtRest(t, {sway * std::sin(3.0 * t), 0.0, 0.0}, &noise), {});
  };
  feel(10.0, 0.1);
  EXPECT_FALSE(standing.holds());
  feel(12.5, 0.0);
  EXPECT_TRUE(standing.holds());
  feel(30.0, 0.0);
  EXPECT_TRUE(standing.holds());
  feel(32.0, 0.1);
  EXPECT_FALSE(standing.holds());
}

/// What the estimate knows to move does not stand, however evenly.
TEST(Standing, SteadyMotionIsNoRest) {
  Noise noise(7);
  Standing standing;
  NavState state;
  state.v.x() = 0.5;
  for (double t = 0.0; t < 5.0; t += 0.005)
    standing.Add(AtRest(t, Eigen::Vector3d::Zero(), &noise), state);
  EXPECT_FALSE(standing.holds());
}

TEST(MapDrift, GrowsWithTheWayAndIsForgottenAtHome) {
  MapDrift drift(DriftConfig{});
  const auto sigma = [&] { return std::sqrt(drift.covariance().topLeftCorner<3, 3>().trace()); };
  double last = 0.0;
  for (int i = 0; i <= 100; ++i) {
    drift.MoveTo({static_cast<double>(i), 0.0, 0.0}, 15.0);
    EXPECT_GE(sigma(), 0.999 * last) << i;
    last = sigma();
  }
  EXPECT_GT(drift.covariance()(1, 1), 10.0 * drift.covariance()(0, 0));  // heading: sideways
  for (int i = 100; i >= 0; --i) drift.MoveTo({static_cast<double>(i), 0.0, 0.0}, 15.0);
  EXPECT_LT(sigma(), 0.1 * last);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(drift.covariance());
  EXPECT_GT(eigen.eigenvalues().minCoeff(), 0.0);
}

TEST(MapDrift, BeginsAsTheFirstMatchDoes) {
  MapDrift drift(DriftConfig{});
  const double before = drift.covariance()(3, 3);
  MapDrift::Covariance match = MapDrift::Covariance::Identity();
  match.diagonal() << 4e-6, 1e-6, 1e-6, 9e-8;
  drift.Begin(match);
  EXPECT_GT(drift.covariance()(0, 0), drift.covariance()(1, 1));
  EXPECT_GT(drift.covariance()(3, 3), 2.0 * before);
  const MapDrift::Covariance first = drift.covariance();
  drift.MoveTo({1.0, 2.0, 3.0}, 8.0);
  EXPECT_LT((drift.covariance() - first).norm(), 1e-12);  // where the map begins
}

TEST(MapDrift, ARestartForgetsNothing) {
  MapDrift drift(DriftConfig{});
  const MapDrift::Covariance astray = 0.04 * MapDrift::Covariance::Identity();
  drift.Restart(astray);
  EXPECT_GE(drift.covariance()(0, 0), astray(0, 0));
  drift.Begin(1e-6 * MapDrift::Covariance::Identity());
  drift.MoveTo({0.0, 0.0, 0.0}, 8.0);
  drift.MoveTo({10.0, 0.0, 0.0}, 8.0);
  EXPECT_GE(drift.covariance()(0, 0), astray(0, 0));
  EXPECT_GT(drift.covariance()(1, 1), astray(1, 1) + 90.0 * astray(3, 3));  // its heading
}

/// The farther away the surfaces, the less the same turn of them holds the place.
TEST(MapDrift, PlaceGoesAstrayWithTheDistanceOfWhatIsSeen) {
  MapDrift near(DriftConfig{}), far(DriftConfig{});
  for (int i = 0; i <= 30; ++i) {
    near.MoveTo({1.0 * i, 0.0, 0.0}, 5.0);
    far.MoveTo({1.0 * i, 0.0, 0.0}, 20.0);
  }
  EXPECT_GT(far.covariance()(0, 0), 4.0 * near.covariance()(0, 0));
  EXPECT_DOUBLE_EQ(far.covariance()(3, 3), near.covariance()(3, 3));
}

TEST(MapDrift, RemembersABoundedNumberOfPlaces) {
  MapDrift drift(DriftConfig{});
  for (int i = 0; i < 20000; ++i) drift.MoveTo({1.0 * i, 0.0, 0.0}, 10.0);
  EXPECT_LE(drift.places(), 500u);
  EXPECT_TRUE(drift.covariance().allFinite());
}

/// Mean normalised squared errors over seeds and time lie where chi-square says for ten runs.
TEST(Consistency, ErrorsAreAsLargeAsTheCovarianceSays) {
  double position = 0.0, yaw = 0.0, n = 0.0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Course course;
    course.duration = 8.0;
    course.seed = seed;
    course.sensors.azimuths = 450;
    Noise noise(100 + seed);
    course.sensors.accel_bias = noise.Vector(0.05);
    course.sensors.gyro_bias = noise.Vector(0.003);
    const CourseResult result = test::Fly(course, test::ConfigFor(course.flight));
    for (size_t i = 400; i < result.visits.size(); i += 100) {
      const auto& visit = result.visits[i];
      const auto& P = visit.estimate.covariance;
      const Eigen::Vector3d e = visit.estimate.X_WB.p - course.flight.X_WB(visit.estimate.t).p;
      const Eigen::Matrix3d P_p = P.topLeftCorner<3, 3>();
      position += e.dot(P_p.ldlt().solve(e));
      yaw += visit.yaw_error * visit.yaw_error / P(8, 8);
      n += 1.0;
    }
  }
  EXPECT_GT(position / n, 1.38);
  EXPECT_LT(position / n, 5.37);
  EXPECT_GT(yaw / n, 0.216);
  EXPECT_LT(yaw / n, 2.52);
}

/// Sweeps that contradict the map cost as much certainty as sweeps that do not come, and no more.
TEST(LostRecovery, RefusedSweepsAreAsGoodAsNone) {
  double sigma[2] = {0.0, 0.0};
  for (const int garbled : {0, 1}) {
    Course course;
    course.duration = 6.5;
    course.sensors.azimuths = 900;
    Noise noise(8);
    course.on_sweep = [&](Sweep* s) {
      if (s->start < 5.0) return true;
      for (auto& point : s->points) point.p += noise.Vector(0.5).cast<float>();
      return garbled == 1;
    };
    const CourseResult result = test::Fly(course, test::ConfigFor(course.flight));
    sigma[garbled] = std::sqrt(result.visits.back().estimate.covariance(0, 0));
    EXPECT_EQ(result.visits.back().estimate.epoch, 0);
  }
  EXPECT_GT(sigma[0], 0.05);
  EXPECT_NEAR(sigma[1], sigma[0], 0.1 * sigma[0]);
}

/// After the loss of all sweeps the estimate is wrong by decimetres; it comes back without a jump
/// and says so.
TEST(LostRecovery, ComesBackWithoutAJumpAndSaysSo) {
  Course course;
  course.duration = 14.0;
  course.sensors.azimuths = 900;
  course.on_sweep = [](Sweep* s) { return s->start < 5.0 || s->start > 8.5; };
  course.on_imu = [](ImuSample* s) {
    if (s->t > 5.2 && s->t < 8.4) s->accel.x() += 0.12;  // so that there is something to correct
    return true;
  };
  const CourseResult result = test::Fly(course, test::ConfigFor(course.flight));
  EXPECT_TRUE(result.Finite());
  bool lost = false, flagged = false;
  for (const auto& visit : result.visits) {
    lost |= visit.estimate.health.health == Health::kLost;
    flagged |= visit.estimate.correcting;
  }
  EXPECT_TRUE(lost);
  EXPECT_TRUE(flagged);
  EXPECT_GT(result.WorstPosition(), 0.2) << "nothing was corrected";
  EXPECT_LT(result.WorstPosition(10.5), 0.1);
  EXPECT_LT(result.WorstJump(), 0.006);
  EXPECT_LT(result.FirstTime(8.7, true), 9.7);
}

}  // namespace
}  // namespace chase::odometry
