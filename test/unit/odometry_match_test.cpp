#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/math/rotation.h"
#include "services/odometry/features.h"
#include "services/odometry/scan_matcher.h"
#include "test/unit/odometry_ceres.h"
#include "test/unit/odometry_synthetic.h"

namespace chase::odometry {
namespace {

using test::Hall;
using test::Noise;
using test::SensorModel;

/// A map of the hall from a few places, and a sweep from another place.
struct Room {
  SurfaceMap planes{MapConfig{}, SurfaceKind::kPlane};
  SurfaceMap posts{MapConfig{}, SurfaceKind::kLine};
  Features features;
  Pose truth{math::ExpSO3({0.05, -0.04, 0.6}), {0.4, 1.0, 1.4}};

  explicit Room(const Hall& hall) : Room(std::vector<Hall>{hall}) {}

  /// The drone comes through the other halls in their order to the last.
  explicit Room(const std::vector<Hall>& halls) {
    Noise noise(1);
    for (const Hall& hall : halls) Learn(hall, &noise);
    features = FeaturesFrom(halls.back(), truth, 10, &noise);
  }

  void Learn(const Hall& hall, Noise* noise) {
    const double middle = 0.5 * (hall.min.x() + hall.max.x());
    for (int i = 0; i < 5; ++i) {
      const Pose at{math::FromYaw(0.3 * i), {middle + 0.3 * i - 0.6, 0.5 * i, 1.2 + 0.1 * i}};
      const Features seen = FeaturesFrom(hall, at, 1, noise);
      const Eigen::Vector3f eye = at.p.cast<float>();
      for (const auto& point : seen.planes)
        planes.Add({(at * point.cast<double>()).cast<float>()}, eye);
      for (const auto& point : seen.posts)
        posts.Add({(at * point.cast<double>()).cast<float>()}, eye);
    }
  }

  static Features FeaturesFrom(const Hall& hall, const Pose& at, size_t stride, Noise* noise) {
    const Sweep sweep = test::Scan(
        hall, [&](double) { return at; }, 0.0, SensorModel{}, noise);
    const FeatureSet set = ExtractFeatures(FeatureConfig{}, sweep.points);
    Features features;
    for (size_t i = 0; i < set.planes.size(); i += stride)
      features.planes.push_back(sweep.points[static_cast<size_t>(set.planes[i])].p);
    for (const Post& post : set.posts)
      features.posts.push_back(sweep.points[static_cast<size_t>(post.point)].p + post.to_axis);
    return features;
  }
};

Pose Disturbed(const Pose& pose, Noise* noise, double position, double rotation) {
  return {math::ExpSO3(noise->Vector(rotation)) * pose.R, pose.p + noise->Vector(position)};
}

TEST(ScanMatcher, JacobiansAgreeWithFiniteDifferences) {
  Noise noise(2);
  constexpr double h = 1e-6;
  for (int trial = 0; trial < 50; ++trial) {
    Surface surface;
    surface.center = noise.Vector(3.0).cast<float>();
    surface.direction = noise.Vector(1.0).normalized().cast<float>();
    const Pose X{math::ExpSO3(noise.Vector(1.0)), noise.Vector(2.0)};
    const Eigen::Vector3d p_B = noise.Vector(4.0);
    for (auto* residual : {&PlaneResidual, &PostResidual}) {
      Vector6d J, unused;
      const double r = (*residual)(X * p_B, X.R * p_B, surface, &J);
      for (int i = 0; i < 6; ++i) {
        Vector6d step = Vector6d::Zero();
        step[i] = h;
        const Eigen::Quaterniond R = math::ExpSO3(step.tail<3>()) * X.R;
        const Eigen::Vector3d p_W = R * p_B + X.p + step.head<3>();
        const double moved = (*residual)(p_W, R * p_B, surface, &unused);
        EXPECT_NEAR((moved - r) / h, J[i], 2e-4) << "trial " << trial << " column " << i;
      }
    }
  }
}

/// Of a pose by which points at a usual distance are uncertain by `u` m.
Matrix6d Uncertain(double u) {
  const double p2 = u * u / 6.0, theta2 = p2 / 64.0;
  Vector6d variances;
  variances << p2, p2, p2, theta2, theta2, theta2;
  return variances.asDiagonal();
}

TEST(ScanMatcher, FindsThePoseFromDisturbedStarts) {
  const Room room(Hall{});
  const ScanMatcher matcher(MatchConfig{});
  Noise noise(3);
  for (int trial = 0; trial < 10; ++trial) {
    const Pose start = Disturbed(room.truth, &noise, 0.08, 0.02);
    const MatchResult match =
        matcher.Match(room.features, room.planes, room.posts, start, Uncertain(0.3));
    ASSERT_TRUE(match.valid) << "trial " << trial;
    EXPECT_FALSE(match.degenerate());
    EXPECT_LT((match.X_WB.p - room.truth.p).norm(), 0.02) << "trial " << trial;
    EXPECT_LT(match.X_WB.R.angularDistance(room.truth.R), 0.004) << "trial " << trial;
  }
}

TEST(ScanMatcher, AgreesWithCeres) {
  const Room room(Hall{});
  MatchConfig config;
  config.max_iterations = 30;
  const ScanMatcher matcher(config);
  Features planes_only{room.features.planes, {}};
  const SurfaceMap no_posts(MapConfig{}, SurfaceKind::kLine);
  const MatchResult ours =
      matcher.Match(planes_only, room.planes, no_posts, room.truth, Uncertain(0.3));
  ASSERT_TRUE(ours.valid);
  const Pose reference =
      test::MatchWithCeres(planes_only.planes, room.planes, ours.X_WB, config.kernel);
  // Ceres does not weigh surfaces by their variance; the minimum is the same to a few millimetres.
  EXPECT_LT((ours.X_WB.p - reference.p).norm(), 0.005);
  EXPECT_LT(ours.X_WB.R.angularDistance(reference.R), 0.001);
}

TEST(ScanMatcher, CorridorLeavesItsAxisToThePrediction) {
  Hall corridor;
  corridor.ends_open = true;
  const Room room(corridor);
  const ScanMatcher matcher(MatchConfig{});
  Pose start = room.truth;
  start.p += Eigen::Vector3d(0.05, 0.20, -0.03);
  const MatchResult match =
      matcher.Match(room.features, room.planes, room.posts, start, Uncertain(0.3));
  ASSERT_TRUE(match.valid);
  EXPECT_TRUE(match.degenerate());
  EXPECT_GT(std::abs(match.weakest[1]), 0.9);
  EXPECT_NEAR(match.X_WB.p.x(), room.truth.p.x(), 0.02);
  EXPECT_NEAR(match.X_WB.p.y(), start.p.y(), 0.05);
}

/// Normals of cells that few rings have crossed lean, each its own way; ranges to walls beside the
/// body are off by millimetres. A few returns from the floor ahead tell the height all the same.
TEST(ScanMatcher, WallsThatLeanDoNotPullTheHeight) {
  SurfaceMap planes{MapConfig{}, SurfaceKind::kPlane}, posts{MapConfig{}, SurfaceKind::kLine};
  const double cell = MapConfig().cell_size, height = 1.2;
  const Eigen::Vector3f eye(0.0f, 0.0f, static_cast<float>(height));
  const auto lean = [cell](double z) { return 0.1 * (z - cell * (std::floor(z / cell) + 0.5)); };
  Features features;
  const auto see = [&](double x, double y, double z) {
    features.planes.push_back(Eigen::Vector3d(x, y, z - height).cast<float>());
  };
  for (double x = -3.0; x < 3.0; x += 0.1)
    for (double z = 0.25; z < 2.2; z += 0.05)
      for (const double side : {-1.2, 1.2}) {
        planes.Add({Eigen::Vector3d(x, side * (1.0 + lean(z)), z).cast<float>()}, eye);
        see(x, side - std::copysign(0.006, side), z);
      }
  for (double x = 4.0; x < 6.0; x += 0.1)
    for (double y = -1.0; y < 1.0; y += 0.1) {
      planes.Add({Eigen::Vector3d(x, y, 0.0).cast<float>()}, eye);
      if (std::abs(y) < 0.05) see(x, y, 0.0);
    }
  const Pose truth{Eigen::Quaterniond::Identity(), {0.0, 0.0, height}};
  const MatchResult match =
      ScanMatcher(MatchConfig{}).Match(features, planes, posts, truth, Uncertain(0.3));
  ASSERT_TRUE(match.valid);
  EXPECT_LT(std::abs(match.X_WB.p.z() - height), 0.01);
}

/// In a climb between walls returns from their feet, where nothing is mapped yet, fall into the
/// coarse cells of a floor that few returns still show.
TEST(ScanMatcher, TheFootOfAWallIsNoFloor) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Noise noise(seed);
    const Pose truth{Eigen::Quaterniond::Identity(), {0.0, 0.0, 0.35}};
    const Eigen::Vector3f eye = truth.p.cast<float>();
    SurfaceMap planes(MapConfig{}, SurfaceKind::kPlane), posts(MapConfig{}, SurfaceKind::kLine);
    Features features;
    const auto between = [&](double a, double b) { return a + (b - a) * noise.Uniform(); };
    const auto learn = [&](int n, const std::function<Eigen::Vector3d()>& point) {
      for (int i = 0; i < n; ++i) planes.Add({point().cast<float>()}, eye);
    };
    const auto see = [&](int n, const std::function<Eigen::Vector3d()>& point) {
      for (int i = 0; i < n; ++i) {
        const Eigen::Vector3d ray = point() - truth.p;
        features.planes.push_back(((1.0 + noise.Gauss(0.02) / ray.norm()) * ray).cast<float>());
      }
    };
    const auto floor = [&] {
      return Eigen::Vector3d(between(0.3, 3.0), between(-1.24, 1.24), noise.Gauss(0.004));
    };
    learn(3000, floor);
    see(20, [&] { return Eigen::Vector3d(between(2.3, 2.8), between(-1.0, 1.0), 0.0); });
    for (const double y : {-1.24, 1.24}) {
      const auto wall = [&] { return Eigen::Vector3d(between(-3.0, 3.0), y, between(0.5, 1.2)); };
      learn(3000, wall);
      see(600, wall);
    }
    see(300, [&] { return Eigen::Vector3d(3.5, between(-1.2, 1.2), between(0.5, 1.2)); });
    learn(3000, [&] { return Eigen::Vector3d(3.5, between(-1.2, 1.2), between(0.5, 1.2)); });
    see(40, [&] { return Eigen::Vector3d(between(0.4, 2.2), -1.24, between(0.03, 0.13)); });
    const MatchResult match =
        ScanMatcher(MatchConfig{}).Match(features, planes, posts, truth, Uncertain(0.003));
    ASSERT_TRUE(match.valid) << seed;
    const double off = std::abs(match.X_WB.p.z() - truth.p.z());
    EXPECT_LT(off, 0.04) << seed;
    EXPECT_LT(off, 3.5 * std::sqrt(match.information.inverse()(2, 2))) << seed;
  }
}

/// Seen from here, the wall shows another face than it showed in the room behind, wherever in the
/// map's cells it stands.
TEST(ScanMatcher, TheOtherFaceOfAThinWallDoesNotPull) {
  constexpr double kThickness = 0.15;
  Noise noise(6);
  for (const double x : {4.0, 4.1, 4.2}) {
    Hall hall, behind;
    hall.max.x() = x, behind.min.x() = x + kThickness, behind.max.x() = x + 8.0;
    behind.pillars.clear();
    const Room room({behind, behind, behind, behind, hall});  // cells are full of the other face
    const Pose start = Disturbed(room.truth, &noise, 0.02, 0.002);
    const MatchResult match =
        ScanMatcher(MatchConfig{})
            .Match(room.features, room.planes, room.posts, start, Uncertain(0.05));
    ASSERT_TRUE(match.valid) << "wall at " << x;
    EXPECT_LT((match.X_WB.p - room.truth.p).norm(), 0.01) << "wall at " << x;
    EXPECT_GT(match.fit, 0.95) << "wall at " << x;
  }
}

/// Down a corridor the foot of the far wall lies in the cells of the floor before it. By their
/// lever a few returns from there would turn the sweep until they seem to lie on that floor.
TEST(ScanMatcher, FarReturnsFromAnotherSurfaceDoNotTurnTheSweep) {
  Noise noise(7);
  const Eigen::Vector3f eye(0.0f, 0.0f, 1.0f);
  SurfaceMap planes(MapConfig{}, SurfaceKind::kPlane), posts(MapConfig{}, SurfaceKind::kLine);
  Features features;
  const auto between = [&](double a, double b) { return a + (b - a) * noise.Uniform(); };
  const auto see = [&](int n, const std::function<Eigen::Vector3d()>& point) {
    for (int i = 0; i < 50 * n; ++i) planes.Add({point().cast<float>()}, eye);
    for (int i = 0; i < n; ++i) features.planes.push_back(point().cast<float>());
  };
  const auto floor = [&](double from, double to) {
    return Eigen::Vector3d(between(from, to), between(-1.2, 1.2), noise.Gauss(0.003));
  };
  see(60, [&] { return floor(1.5, 4.0); });
  see(2, [&] { return floor(16.5, 17.5); });
  for (const double y : {-1.5, 1.5})
    see(400, [&] {
      return Eigen::Vector3d(between(0.0, 8.0), y + noise.Gauss(0.01), between(0.0, 2.0));
    });
  see(80, [&] {
    return Eigen::Vector3d(-1.5 + noise.Gauss(0.02), between(-1.2, 1.2), between(0.8, 1.2));
  });
  for (int i = 0; i < 20; ++i)
    features.planes.push_back(Eigen::Vector3f(17.3f, -1.0f + 0.1f * static_cast<float>(i), 0.09f));
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(1e-6), Eigen::Vector3d::Constant(1e-7);
  const ScanMatcher matcher(MatchConfig{});
  const Matrix6d prior = variances.asDiagonal();
  /// What is left of the turn once a filter has weighed the match against the prediction.
  const auto turned = [&](const Matrix6d& covariance) {
    const MatchResult match = matcher.Match(features, planes, posts, Pose{}, covariance);
    EXPECT_TRUE(match.valid);
    Vector6d e;
    e << match.X_WB.p, math::LogSO3(match.X_WB.R);
    const Matrix6d innovation = prior + match.information.inverse();
    return (prior * innovation.ldlt().solve(e)).tail<3>().norm();
  };
  EXPECT_LT(turned(prior), 0.0015);
  EXPECT_GT(turned(1e6 * prior), 0.002) << "the sweep alone is not turned: no case";
}

/// What the map does not know yet says nothing against a match with what it knows.
TEST(ScanMatcher, UnmappedFeaturesDoNotSpeakAgainstAMatch) {
  Room room(Hall{});
  const size_t mapped = room.features.planes.size();
  Noise noise(4);
  for (size_t i = 0; i < 9 * mapped; ++i) {
    const Eigen::Vector3d p_W(100.0 + 20.0 * noise.Uniform(), 20.0 * noise.Uniform(), 1.0);
    room.features.planes.push_back((room.truth.Inverse() * p_W).cast<float>());
  }
  const Pose start = Disturbed(room.truth, &noise, 0.03, 0.005);
  const MatchResult match =
      ScanMatcher(MatchConfig{})
          .Match(room.features, room.planes, room.posts, start, Uncertain(0.1));
  ASSERT_TRUE(match.valid);
  EXPECT_NEAR(match.unmapped, 0.9, 0.03);
  EXPECT_GT(match.fit, 0.9);
  EXPECT_LT((match.X_WB.p - room.truth.p).norm(), 0.02);
}

/// Features scattered about the surfaces contradict the map, however many find one.
TEST(ScanMatcher, ScatteredFeaturesAreAMisfit) {
  Room room(Hall{});
  Noise noise(5);
  for (auto& p : room.features.planes) p += noise.Vector(0.5).cast<float>();
  const MatchResult match =
      ScanMatcher(MatchConfig{})
          .Match(room.features, room.planes, room.posts, room.truth, Uncertain(0.3));
  EXPECT_FALSE(match.valid);
  EXPECT_TRUE(match.misfit);
}

/// A few slanting returns on walls do not hold the axis, noise of their normals or not.
TEST(ScanMatcher, KnownDirectionsAreOrthonormalAndOfOneKind) {
  Hall corridor;
  corridor.ends_open = true;
  const Room room(corridor);
  const MatchResult match =
      ScanMatcher(MatchConfig{})
          .Match(room.features, room.planes, room.posts, room.truth, Uncertain(0.1));
  ASSERT_TRUE(match.valid);
  ASSERT_EQ(match.known.cols(), 5);
  EXPECT_LT((match.known.transpose() * match.known - Eigen::MatrixXd::Identity(5, 5)).norm(), 1e-9);
  for (int i = 0; i < 5; ++i)
    EXPECT_LT(match.known.col(i).head<3>().norm() * match.known.col(i).tail<3>().norm(), 1e-12);
}

TEST(ScanMatcher, NoFeaturesIsNoMatch) {
  const Room room(Hall{});
  const MatchResult match =
      ScanMatcher(MatchConfig{}).Match({}, room.planes, room.posts, room.truth, Uncertain(0.1));
  EXPECT_FALSE(match.valid);
  EXPECT_TRUE(match.X_WB.p.allFinite());
}

TEST(ScanMatcher, AnotherPlaceIsNoMatch) {
  const Room room(Hall{});
  Pose elsewhere = room.truth;
  elsewhere.p += Eigen::Vector3d(60.0, 0.0, 0.0);
  EXPECT_FALSE(ScanMatcher(MatchConfig{})
                   .Match(room.features, room.planes, room.posts, elsewhere, Uncertain(0.1))
                   .valid);
}

}  // namespace
}  // namespace chase::odometry
