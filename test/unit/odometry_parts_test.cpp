#include <gtest/gtest.h>

#include <cmath>

#include "common/math/rotation.h"
#include "services/odometry/correction_blend.h"
#include "services/odometry/deskew.h"
#include "services/odometry/features.h"
#include "services/odometry/odometry_config.h"
#include "services/odometry/surface_map.h"
#include "test/unit/odometry_synthetic.h"

namespace chase::odometry {
namespace {

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
