#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "test/unit/odometry_course.h"

namespace chase::odometry {
namespace {

using test::Course;
using test::CourseResult;
using test::Flight;

CourseResult FlyDefault(const Course& course) {
  return test::Fly(course, test::ConfigFor(course.flight));
}

/// The flight used for faults: ten seconds, the fault strikes at seven.
Course ShortCourse() {
  Course course;
  course.duration = 10.0;
  course.sensors.azimuths = 900;
  return course;
}

constexpr double kFault = 7.0;  // s

void ExpectSurvived(const CourseResult& result, double recovered_by) {
  EXPECT_TRUE(result.Finite());
  EXPECT_LT(result.FirstTime(kFault, false), kFault + 0.2) << "health came late";
  // Within a second, and the pose after that.
  EXPECT_LT(result.FirstTime(recovered_by - 1e-9, true), recovered_by + 1.006) << "no recovery";
  EXPECT_LT(result.WorstPosition(), 0.3);
  EXPECT_LT(result.WorstJump(), 0.006);
}

TEST(OdometryFlight, HallIsFlownWithinCentimetres) {
  Course course;
  course.duration = 15.0;
  const CourseResult result = FlyDefault(course);
  EXPECT_TRUE(result.Finite());
  EXPECT_LT(result.PositionRms(), 0.03);
  EXPECT_LT(result.VelocityRms(), 0.06);
  EXPECT_LT(result.WorstJump(), 0.003);
  EXPECT_EQ(result.visits.back().estimate.health.health, Health::kOk);
  EXPECT_GT(result.sweeps.size(), 140u);
}

TEST(OdometryFlight, AggressiveFlightIsNotLost) {
  Course course;
  course.flight = Flight::Aggressive();
  course.duration = 12.0;
  course.seed = 2;
  const CourseResult result = FlyDefault(course);
  EXPECT_TRUE(result.Finite());
  EXPECT_LT(result.PositionRms(), 0.05);
  EXPECT_LT(result.WorstPosition(), 0.10);
}

TEST(OdometryFlight, StandingStillDoesNotDrift) {
  Course course = ShortCourse();
  course.flight = Flight::AtRest();
  EXPECT_LT(FlyDefault(course).WorstPosition(), 0.005);
}

/// Sweeps are refused for as long as dust or a hand covers the LiDAR; inertia knows that it stands.
TEST(OdometryFlight, StandingWhileSweepsShowNothingDoesNotDrift) {
  Course course = ShortCourse();
  course.duration = 30.0;
  course.flight = Flight::AtRest();
  test::Noise noise(5);
  course.on_sweep = [&noise](Sweep* s) {
    if (s->start < 3.0) return true;
    for (auto& point : s->points) point.p *= static_cast<float>(0.3 + noise.Uniform());
    return true;
  };
  const CourseResult result = FlyDefault(course);
  EXPECT_LT(result.WorstPosition(), 0.01);
  EXPECT_EQ(result.visits.back().estimate.epoch, 0);
}

/// To the inertial unit a body that slides evenly is one at rest; the sweeps tell.
TEST(OdometryFlight, OneThatSlidesWhileItAlignsIsNotTakenForOneAtRest) {
  for (const double speed : {0.1, 0.6, 1.5}) {
    Course course = ShortCourse();
    course.duration = 3.0;
    course.flight.start = {-2.0, 2.0, 0.2};
    course.flight.slide = speed * Eigen::Vector3d(0.8, -0.6, 0.0);
    const CourseResult result = FlyDefault(course);
    EXPECT_LT(result.WorstPosition(1.0), 0.06) << speed;
    EXPECT_LT(result.VelocityRms(1.0), 0.1) << speed;
  }
}

TEST(OdometryFlight, SweepsAloneSuffice) {
  Course course;
  course.duration = 10.0;
  course.on_imu = [](ImuSample*) { return false; };
  const CourseResult result = FlyDefault(course);
  EXPECT_EQ(result.visits.size(), 100u);  // one pose per sweep
  EXPECT_LT(result.PositionRms(), 0.03);
}

TEST(OdometryFlight, StartInMotionIsSaidAndSurvived) {
  Course course = ShortCourse();
  course.flight.rest = -4.0;
  OdometryConfig config;
  const Pose at_end_of_alignment = course.flight.X_WB(0.5);
  config.initial_position = at_end_of_alignment.p;
  const Eigen::Vector3d x_W = at_end_of_alignment.R * Eigen::Vector3d::UnitX();
  config.initial_yaw_deg = std::atan2(x_W.y(), x_W.x()) * 180.0 / M_PI;
  const CourseResult result = test::Fly(course, config);
  EXPECT_TRUE(result.Finite());
  EXPECT_EQ(result.visits[101].estimate.health.health, Health::kDegraded);
  EXPECT_EQ(result.visits.back().estimate.health.health, Health::kOk);
  EXPECT_LT(result.VelocityRms(5.0), 0.6);
}

/// Switched on amid turns: the first sweep began before the inertial unit was heard.
TEST(OdometryFlight, BegunAmidTurnsItKnowsItsVelocityAndItsBiases) {
  constexpr double kFirst = 0.09;  // s
  for (int i = 0; i < 12; ++i) {
    Course course = ShortCourse();
    course.duration = 1.5;
    course.seed = 40 + static_cast<unsigned>(i);
    course.flight = Flight::Aggressive();
    course.flight.rest = -4.0 - 0.45 * i;
    course.on_imu = [](ImuSample* s) { return s->t >= kFirst; };
    const CourseResult result = FlyDefault(course);
    EXPECT_TRUE(result.Finite());
    double worst = 0.0, bias = 0.0;
    for (const test::Visit& visit : result.visits) {
      const PoseEstimate& e = visit.estimate;
      if (e.t < 0.7) continue;
      const Eigen::Vector3d v_B = e.X_WB.R.conjugate() * e.v,
                            truth =
                                course.flight.X_WB(e.t).R.conjugate() * course.flight.Velocity(e.t);
      worst = std::max(worst, (v_B - truth).norm());
      bias = std::max(bias, (e.accel_bias - course.sensors.accel_bias).norm());
    }
    EXPECT_LT(worst, 0.15) << i;
    EXPECT_LT(bias, 0.25) << i;
  }
}

TEST(OdometryFaults, OneSecondWithoutSweeps) {
  Course course = ShortCourse();
  course.on_sweep = [](Sweep* s) { return s->start < kFault - 0.1 || s->start > kFault + 0.9; };
  ExpectSurvived(FlyDefault(course), kFault + 1.0);
}

TEST(OdometryFaults, ThreeTenthsOfASecondWithoutImu) {
  Course course = ShortCourse();
  course.on_imu = [](ImuSample* s) { return s->t < kFault || s->t > kFault + 0.3; };
  const CourseResult result = FlyDefault(course);
  EXPECT_TRUE(result.Finite());
  EXPECT_LT(result.FirstTime(kFault, false), kFault + 0.2);
  EXPECT_LT(result.FirstTime(kFault + 0.3, true), kFault + 1.3);
  EXPECT_LT(result.WorstPosition(), 0.3);
}

TEST(OdometryFaults, BareCorridor) {
  Course course = ShortCourse();
  course.duration = 12.0;
  course.corridor_from = kFault;
  course.corridor_to = kFault + 3.0;
  ExpectSurvived(FlyDefault(course), kFault + 3.0);
}

TEST(OdometryFaults, ThirtyPercentOfThePointsDropped) {
  Course course = ShortCourse();
  test::Noise noise(9);
  course.on_sweep = [&noise](Sweep* s) {
    if (s->start < kFault - 0.05) return true;
    std::vector<SweepPoint> kept;
    for (const auto& point : s->points)
      if (noise.Uniform() > 0.3) kept.push_back(point);
    s->points = kept;
    return true;
  };
  const CourseResult result = FlyDefault(course);
  EXPECT_TRUE(result.Finite());
  EXPECT_LT(result.FirstTime(kFault, false), kFault + 0.2);
  EXPECT_LT(result.WorstPosition(), 0.05);
}

TEST(OdometryFaults, ASweepOfNan) {
  Course course = ShortCourse();
  course.on_sweep = [](Sweep* s) {
    if (s->start > kFault - 0.05 && s->start < kFault + 0.05)
      for (auto& point : s->points) point.p.setConstant(std::numeric_limits<float>::quiet_NaN());
    return true;
  };
  ExpectSurvived(FlyDefault(course), kFault + 0.2);
}

TEST(OdometryFaults, TimeStampsFiftyMillisecondsLate) {
  Course course = ShortCourse();
  course.on_sweep = [](Sweep* s) {
    if (s->start > kFault - 0.05 && s->start < kFault + 1.0) s->start += 0.05;
    return true;
  };
  ExpectSurvived(FlyDefault(course), kFault + 1.2);
}

TEST(OdometryFaults, DuplicatesAndStaleMessagesAreDropped) {
  Odometry odometry(OdometryConfig{});
  const ImuSample imu{1.0, {0.0, 0.0, 9.81}, Eigen::Vector3d::Zero()};
  EXPECT_TRUE(odometry.AddImu(imu));
  EXPECT_FALSE(odometry.AddImu(imu));
  ImuSample bad = imu;
  bad.t = 1.1;
  bad.gyro.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(odometry.AddImu(bad));
  EXPECT_EQ(odometry.dropped_samples(), 2);
  odometry.AddSweep(Sweep{});  // aligning: nothing to do with it
  EXPECT_FALSE(odometry.SweepReady());
}

TEST(OdometryFaults, EmptySweepsNeverStartAnything) {
  Odometry odometry(OdometryConfig{});
  odometry.AddSweep(Sweep{});
  ASSERT_TRUE(odometry.SweepReady());
  const SweepResult result = odometry.ProcessSweep();
  EXPECT_FALSE(result.pose);
  EXPECT_FALSE(result.registered);
}

TEST(OdometryFlight, SameInputSameOutput) {
  Course course = ShortCourse();
  course.duration = 4.0;
  const CourseResult a = FlyDefault(course), b = FlyDefault(course);
  ASSERT_EQ(a.visits.size(), b.visits.size());
  for (size_t i = 0; i < a.visits.size(); ++i) {
    EXPECT_EQ(a.visits[i].estimate.X_WB.p, b.visits[i].estimate.X_WB.p);
    EXPECT_EQ(a.visits[i].estimate.covariance, b.visits[i].estimate.covariance);
  }
}

}  // namespace
}  // namespace chase::odometry
