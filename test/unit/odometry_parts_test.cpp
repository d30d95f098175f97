#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "common/math/rotation.h"
#include "services/odometry/correction_blend.h"
#include "services/odometry/deskew.h"
#include "services/odometry/error_state_filter.h"
#include "services/odometry/features.h"
#include "services/odometry/odometry_config.h"
#include "services/odometry/surface_map.h"
#include "test/unit/odometry_synthetic.h"

namespace chase::odometry {
namespace {

using test::Flight;
using test::Hall;
using test::Noise;
using test::SensorModel;

Pose TwistedPose(double t) {
  return {math::ExpSO3({0.3 * t, -0.5 * t, 1.5 * t}), {2.0 * t, -t, 0.5 * t}};
}

SensorModel Noiseless() {
  SensorModel model;
  model.range_noise = 0.0;
  return model;
}

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

TEST(Deskew, SweepTakenInMotionMatchesSweepTakenAtRestAtItsEnd) {
  Hall hall;
  hall.pillars.clear();
  Noise noise(1);
  const auto X_WL = [](double t) {
    Pose pose = TwistedPose(t);
    pose.p.z() += 1.5;
    return pose;
  };
  const Sweep sweep = test::Scan(hall, X_WL, 0.0, Noiseless(), &noise);
  std::vector<Pose> poses;
  for (int i = 0; i <= 20; ++i) poses.push_back(X_WL(0.005 * i));
  const SweepMotion motion(poses, 0.005);
  const Pose end = X_WL(0.1);
  for (size_t i = 0; i < sweep.points.size(); i += 37) {
    const SweepPoint& point = sweep.points[i];
    const Eigen::Vector4f p_L(point.p.x(), point.p.y(), point.p.z(), 0.0f);
    const Eigen::Vector3d p_W = end * motion.ToEnd(p_L, point.t).head<3>().cast<double>();
    const Eigen::Vector3d truth = X_WL(point.t) * point.p.cast<double>();
    EXPECT_LT((p_W - truth).norm(), 1.5e-3) << "point " << i;
    // Every return lies on a wall again.
    const double gap =
        std::min((p_W - hall.min).cwiseAbs().minCoeff(), (p_W - hall.max).cwiseAbs().minCoeff());
    EXPECT_LT(gap, 1.5e-3);
  }
}

TEST(Deskew, StillBodyChangesNothing) {
  const Eigen::Vector4f p(1.0f, 2.0f, 3.0f, 0.0f);
  EXPECT_TRUE(SweepMotion::Still().ToEnd(p, 0.07f).isApprox(p));
}

TEST(FeaturesOfARoom, WallsGivePlanesAndPillarsGiveTheirAxes) {
  Hall hall;
  Noise noise(2);
  std::vector<int> seen(hall.pillars.size(), 0);
  for (const double y : {-5.0, -2.0, 0.5, 4.0}) {
    const auto X_WL = [y](double) { return Pose{math::FromYaw(y), {0.5, y, 1.5}}; };
    const Sweep sweep = test::Scan(hall, X_WL, 0.0, SensorModel{}, &noise);
    const FeatureSet features = ExtractFeatures(FeatureConfig{}, sweep.points);
    EXPECT_GT(features.planes.size(), sweep.points.size() / 2);
    for (const Post& post : features.posts) {
      const Eigen::Vector3f p_L = sweep.points[static_cast<size_t>(post.point)].p + post.to_axis;
      const Eigen::Vector2d axis = (X_WL(0) * p_L.cast<double>()).head<2>();
      std::vector<double> off;
      for (const auto& pillar : hall.pillars) off.push_back((axis - pillar.center).norm());
      const auto nearest = std::min_element(off.begin(), off.end());
      EXPECT_LT(*nearest, 0.06) << "at " << axis.transpose();
      ++seen[static_cast<size_t>(nearest - off.begin())];
    }
  }
  for (size_t i = 0; i < seen.size(); ++i) EXPECT_GE(seen[i], 16) << "pillar " << i;
}

TEST(FeaturesOfARoom, BareWallsGiveNoPost) {
  Hall hall;
  hall.pillars.clear();
  Noise noise(2);
  const auto X_WL = [](double) { return Pose{Eigen::Quaterniond::Identity(), {0.5, 0.5, 1.5}}; };
  const Sweep sweep = test::Scan(hall, X_WL, 0.0, SensorModel{}, &noise);
  EXPECT_TRUE(ExtractFeatures(FeatureConfig{}, sweep.points).posts.empty());
}

/// A sweep of 16 rings from the origin, which begins at a far wall in its back; `range` [m] of a
/// horizontal direction ahead, 0 where nothing is.
template <class Range>
Sweep SweepOf(const Range& range, Noise* noise) {
  Sweep sweep;
  for (int azimuth = 0; azimuth < 1800; ++azimuth)
    for (int ring = 0; ring < 16; ++ring) {
      const double turn = azimuth * M_PI / 900.0 - M_PI_2,
                   rise = (2.0 * ring - 15.0) * M_PI / 180.0;
      const Eigen::Vector3d way(std::cos(turn), std::sin(turn), std::tan(rise));
      const double r = way.y() < -0.2 ? -12.0 / way.y() : range(Eigen::Vector2d(way.head<2>()));
      if (r <= 0.0) continue;
      SweepPoint point;
      point.p = (way * (r + 0.02 * noise->Vector(1.0).x())).cast<float>();
      point.t = static_cast<float>(azimuth) * 0.1f / 1800.0f;
      point.ring = static_cast<uint8_t>(ring);
      sweep.points.push_back(point);
    }
  return sweep;
}

TEST(FeaturesOfARoom, WallsGiveTheirEnds) {
  Noise noise(4);
  const auto wall = [](const Eigen::Vector2d& way) {
    const double r = 5.0 / way.y();
    return r > 0.0 && std::abs(r * way.x() - 1.0) < 5.0 ? r : 0.0;
  };
  const Sweep sweep = SweepOf(wall, &noise);
  int left = 0, right = 0;
  for (const Post& post : ExtractFeatures(FeatureConfig{}, sweep.points).posts) {
    const Eigen::Vector3f p = sweep.points[static_cast<size_t>(post.point)].p + post.to_axis;
    if (p.y() < 0.0f) continue;
    EXPECT_NEAR(p.y(), 5.0, 0.15);
    EXPECT_NEAR(p.x(), p.x() < 0.0f ? -4.0 : 6.0, 0.1);
    ++(p.x() < 0.0f ? left : right);
  }
  EXPECT_GE(left, 12);
  EXPECT_GE(right, 12);
}

/// Outlines of what is round and wide move with the view.
TEST(FeaturesOfARoom, AWideTankGivesNothing) {
  Noise noise(5);
  const auto tank = [](const Eigen::Vector2d& way) {
    const double along = 6.0 * way.y(), across = 6.0 * way.x();
    return along > 0.0 && std::abs(across) < 1.2 ? along - std::sqrt(1.44 - across * across) : 0.0;
  };
  const Sweep sweep = SweepOf(tank, &noise);
  for (const Post& post : ExtractFeatures(FeatureConfig{}, sweep.points).posts)
    EXPECT_LT(sweep.points[static_cast<size_t>(post.point)].p.y(), 0.0f);
}

TEST(FeaturesOfARoom, UnusablePointsAreRemoved) {
  std::vector<SweepPoint> points(6);
  points[0].p = {std::nanf(""), 0.0f, 0.0f};
  points[1].p = {0.1f, 0.0f, 0.0f};
  points[2].p = {500.0f, 0.0f, 0.0f};
  points[3].p = points[4].p = points[5].p = {5.0f, 0.0f, 0.0f};
  points[3].t = -1.0f;
  points[4].t = std::nanf("");
  RemoveUnusable(FeatureConfig{}, &points);
  EXPECT_EQ(points.size(), 1u);
}

const Eigen::Vector3f kEye(0.0f, 0.0f, 3.0f);  // frame W, m

TEST(SurfaceMap, FindsThePlaneThatItsPointsCameFrom) {
  Noise noise(3);
  SurfaceMap map(MapConfig{}, SurfaceKind::kPlane);
  const Eigen::Vector3d normal = Eigen::Vector3d(1.0, 2.0, -0.5).normalized();
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  for (int i = 0; i < 20000; ++i)
    map.Add({(4.0 * (noise.Uniform() - 0.5) * u + 4.0 * (noise.Uniform() - 0.5) * v +
              noise.Gauss(0.01) * normal)
                 .cast<float>()},
            kEye);
  const Surface* surface = map.Find(Eigen::Vector3f::Zero(), kEye);
  ASSERT_NE(surface, nullptr);
  EXPECT_GT(std::abs(surface->direction.cast<double>().dot(normal)), 0.99);
  EXPECT_LT(std::abs(surface->center.cast<double>().dot(normal)), 0.01);
  EXPECT_EQ(map.Find(Eigen::Vector3f(50.0f, 0.0f, 0.0f), kEye), nullptr);
}

/// A wall thinner than a cell: each room knows its own face of it, whichever was learnt first, and
/// when the map has forgotten what is far.
TEST(SurfaceMap, TellsTheFacesOfAThinWallApart) {
  constexpr float kThickness = 0.15f;
  Noise noise(7);
  MapConfig config;
  config.max_cells = 1300;
  SurfaceMap map(config, SurfaceKind::kPlane);
  const auto learn = [&](float x, const Eigen::Vector3f& eye) {
    std::vector<Eigen::Vector3f> points;
    for (int i = 0; i < 20000; ++i)
      points.push_back({x + static_cast<float>(noise.Gauss(0.01)),
                        static_cast<float>(4.0 * noise.Uniform()),
                        static_cast<float>(2.0 * noise.Uniform())});
    map.Add(points, eye);
  };
  const Eigen::Vector3f west(-1.0f, 2.0f, 1.0f), east(1.0f, 2.0f, 1.0f);
  const auto expect_faces = [&] {
    for (int i = 0; i < 200; ++i) {
      const float y = static_cast<float>(0.2 + 3.6 * noise.Uniform());
      for (const bool in_east : {false, true}) {
        const float x = in_east ? kThickness : 0.0f;
        const Surface* face = map.Find({x, y, 1.0f}, in_east ? east : west);
        ASSERT_NE(face, nullptr) << "y " << y;
        EXPECT_NEAR(face->center.x(), x, 0.005f);
        EXPECT_NEAR(face->direction.x(), in_east ? 1.0f : -1.0f, 0.01f);
      }
    }
  };
  learn(0.0f, west);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3f p(kThickness, static_cast<float>(4.0 * noise.Uniform()), 1.0f);
    ASSERT_EQ(map.Find(p, east), nullptr);
  }
  learn(kThickness, east);
  expect_faces();
  for (int i = 0; i < 2000; ++i)
    map.Add({Eigen::Vector3f(100.0f, 0.0f, 0.0f) + noise.Vector(10.0).cast<float>()}, east);
  const size_t full = map.cells();
  map.Prune(east);
  EXPECT_LT(map.cells(), full / 2);
  expect_faces();
}

/// What a match relies on that does not look a feature up again.
TEST(SurfaceMap, AnswerHoldsWithinItsReach) {
  constexpr int kSeed = 5, kPlaces = 2000;
  Noise noise(kSeed);
  SurfaceMap map(MapConfig{}, SurfaceKind::kPlane);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 20000; ++i)
    points.push_back(
        (noise.Vector(3.0).cwiseProduct(Eigen::Vector3d(1.0, 1.0, 0.01))).cast<float>());
  map.Add(points, kEye);
  std::vector<Query> places(kPlaces);
  std::vector<Query*> all;
  for (Query& place : places) place.p = noise.Vector(3.0).cast<float>(), all.push_back(&place);
  map.Find(all, kEye);
  int far = 0;
  for (const Query& place : places) {
    EXPECT_EQ(map.Find(place.p, kEye), place.surface) << "seed " << kSeed;
    far += place.reach > 0.01f ? 1 : 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3f to(corner & 1 ? 1.0f : -1.0f, corner & 2 ? 1.0f : -1.0f,
                               corner & 4 ? 1.0f : -1.0f);
      const Eigen::Vector3f p = place.p + 0.99999f * place.reach * to;
      EXPECT_EQ(map.Find(p, kEye), place.surface) << "seed " << kSeed;
    }
  }
  EXPECT_GT(far, kPlaces / 2);
}

TEST(SurfaceMap, MemoryStaysBoundedOverALongWay) {
  MapConfig config;
  config.max_cells = 5000;
  SurfaceMap map(config, SurfaceKind::kPlane);
  Noise noise(4);
  size_t half_way = 0;
  for (int i = 0; i < 400000; ++i) {
    const Eigen::Vector3f at(0.005f * static_cast<float>(i), 0.0f, 0.0f);
    map.Add({at + noise.Vector(10.0).cast<float>()}, at);
    if (i % 500 == 0) map.Prune(at);
    if (i == 200000) half_way = map.MemoryBytes();
  }
  EXPECT_LE(map.cells(), 4u * 5000u);
  EXPECT_LE(static_cast<double>(map.MemoryBytes()), 1.05 * static_cast<double>(half_way));
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
  const UpdateResult result = Update(FilterConfig{}, z, {0.1}, &state);
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
  ASSERT_TRUE(Update(FilterConfig{}, z, {0.1}, &state).applied);
  z.information(0, 1) = z.information(1, 0) = 0.05e6;
  ASSERT_TRUE(Update(FilterConfig{}, z, {0.1}, &coupled).applied);
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
  ASSERT_TRUE(Update(FilterConfig{}, usual.z, {0.1}, &usual.state).applied);
  ASSERT_TRUE(Update(FilterConfig{}, large.z, {0.1}, &large.state).applied);
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
    JumpEvidence jump;
    for (int sample = 1; sample <= 100; ++sample) {
      Propagate(FilterConfig{}, {0.005 * sample, {0.0, 0.0, 9.81}, Eigen::Vector3d::Zero()},
                &state);
      if (sample % 20 != 0 || sample <= 20 * missed) continue;
      PoseMeasurement z{Pose{}, Eigen::Matrix<double, 6, 6>::Identity(),
                        1e6 * Eigen::Matrix<double, 6, 6>::Identity(), MatchConfig{}.least_gate};
      z.X_WB.p.x() = 0.1 + 0.1 * state.t;
      jump.gap = state.t;
      const UpdateResult result = Update(FilterConfig{}, z, jump, &state);
      EXPECT_FALSE(result.applied) << "at " << state.t << " s";
      jump.odds = result.odds;
    }
    EXPECT_LT(state.accel_bias.norm(), 0.05) << missed << " missed";
    EXPECT_LT(state.v.norm(), 0.05) << missed << " missed";
  }
}

TEST(ErrorStateFilter, ImpossibleInnovationIsRefused) {
  Innovation innovation(0.5);
  const UpdateResult result = Update(FilterConfig{}, innovation.z, {0.1}, &innovation.state);
  EXPECT_FALSE(result.applied);
  EXPECT_GT(result.nis, FilterConfig{}.largest_nis);
  EXPECT_EQ(innovation.state.p, Eigen::Vector3d::Zero());
}

TEST(ErrorStateFilter, UpdateWithoutInformationIsRefused) {
  NavState state;
  PoseMeasurement z;
  z.known = Eigen::MatrixXd::Identity(6, 6);
  z.information.setZero();
  EXPECT_FALSE(Update(FilterConfig{}, z, {0.1}, &state).applied);
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
    ASSERT_TRUE(Update(config, z, {0.1}, &state).applied) << i;
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

TEST(CorrectionBlend, SpreadsAJumpWithoutLosingIt) {
  CorrectionBlend blend{BlendConfig{}};
  const Pose before{Eigen::Quaterniond::Identity(), {1.0, 0.0, 0.0}};
  const Pose after{math::FromYaw(0.1), {1.3, 0.0, 0.0}};
  blend.Absorb(before, Eigen::Vector3d::Zero(), after, Eigen::Vector3d::Zero());
  EXPECT_LT((blend.Applied(after).p - before.p).norm(), 1e-12);
  EXPECT_TRUE(blend.correcting());
  Eigen::Vector3d last = before.p;
  for (int i = 0; i < 400; ++i) {
    blend.Decay(0.005);
    const Eigen::Vector3d p = blend.Applied(after).p;
    EXPECT_LE((p - last).norm(), 0.4 * 0.005 + 1e-12);
    last = p;
  }
  EXPECT_LT((last - after.p).norm(), 1e-3);
  EXPECT_LT(blend.Applied(after).R.angularDistance(after.R), 1e-3);
  EXPECT_FALSE(blend.correcting());
}

TEST(OdometryConfig, ProblemsNameFieldAndValue) {
  EXPECT_EQ(OdometryConfig{}.Problem(), "");
  OdometryConfig config;
  config.map.cell_size = -1.0;
  EXPECT_NE(config.Problem().find("map.cell_size is -1"), std::string::npos);
  config = {};
  config.match_points = 10;
  EXPECT_NE(config.Problem().find("match_points"), std::string::npos);
}

}  // namespace
}  // namespace chase::odometry
