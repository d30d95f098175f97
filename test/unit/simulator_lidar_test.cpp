#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "common/world/random.h"
#include "common/world/scenario.h"
#include "services/simulator/lidar.h"

namespace chase::simulator {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

/// A world with the target out of the way.
world::Scenario World(const std::string& parts) {
  return world::ParseScenario(
      "name: test\ntarget: {waypoints: [[200, 200], [210, 200]], carrier_size: [0, 0, 0]}\n"
      "world: {" +
          parts + "}\n",
      "test");
}

LidarConfig Exact() {
  LidarConfig config;
  config.noise = config.dropout = 0.0;
  return config;
}

world::Rig CentredRig() {
  world::Rig rig;
  rig.lidar_position.setZero();
  return rig;
}

using Motion = std::function<TimedPose(double t)>;

/// One sweep along a motion of the body.
Sweep SweepAlong(const LidarConfig& config, const world::Rig& rig, const Scene& scene,
                 const Motion& motion, uint64_t seed = 1) {
  Lidar lidar(config, rig, seed);
  for (int tick = 0; tick < 20; ++tick) {
    std::vector<TimedPose> poses;
    for (int i = 0; i <= 5; ++i) poses.push_back(motion(0.005 * tick + 0.001 * i));
    lidar.Advance(poses, scene);
  }
  return *lidar.Take();
}

Motion Standing(const Vector3d& p, const Quaterniond& q = Quaterniond::Identity()) {
  return [p, q](double t) { return TimedPose{t, p, q}; };
}

Vector3d Point(const Sweep& sweep, std::size_t i) { return {sweep.x[i], sweep.y[i], sweep.z[i]}; }

TEST(Random, SkippedDrawsShiftNothing) {
  for (unsigned pattern = 0; pattern < 256; ++pattern) {
    world::Random all(7), some(7);
    for (unsigned i = 0; i < 8; ++i) {
      const double drawn = all.Gaussian();
      if ((pattern >> i & 1) != 0) {
        some.SkipGaussian();
      } else {
        EXPECT_EQ(some.Gaussian(), drawn) << pattern << " " << i;
      }
      EXPECT_EQ(some.Uniform(), all.Uniform());
    }
  }
}

TEST(Lidar, FiresOnceAPeriodClockwiseFromTheBack) {
  EXPECT_NEAR(
      (LaserDirection(0, 7) - Vector3d(-std::cos(kPi / 180), 0, -std::sin(kPi / 180))).norm(), 0.0,
      6e-3);
  EXPECT_GT(LaserDirection(450, 7).y(), 0.99);  // a quarter later: left
  EXPECT_GT(LaserDirection(900, 7).x(), 0.99);  // then ahead
  EXPECT_NEAR(std::asin(LaserDirection(3, 0).z()), -15.0 * kPi / 180.0, 1e-12);
  EXPECT_NEAR(std::asin(LaserDirection(3, 15).z()), 15.0 * kPi / 180.0, 1e-12);
  EXPECT_NEAR(LaserDelay(0), 0.0, 1e-12);
  EXPECT_NEAR(LaserDelay(8), 2.304e-6, 1e-12);
  EXPECT_NEAR(LaserDelay(15), 15 * 2.304e-6, 1e-12);
}

TEST(Lidar, GroundRangesAreThoseOfAPlane) {
  const Scene scene(World("ground: {height: 0}"));
  const Sweep sweep = SweepAlong(Exact(), CentredRig(), scene, Standing({3.0, -2.0, 1.5}));
  // Rings 0 to 6 meet the ground within 100 m; ring 7 meets it at 86 m.
  EXPECT_EQ(sweep.x.size(), 8u * kFirings);
  for (std::size_t i = 0; i < sweep.x.size(); ++i) {
    ASSERT_LT(sweep.ring[i], 8);
    const double elevation = (15.0 - 2.0 * sweep.ring[i]) * kPi / 180.0;
    EXPECT_NEAR(Point(sweep, i).norm(), 1.5 / std::sin(elevation), 2e-3);
  }
}

TEST(Lidar, FullSphereGives28800Rays) {
  const Scene scene(World("ellipsoids: [{center: [0, 0, 0], radii: [20, 20, 20]}]"));
  const Sweep sweep = SweepAlong(Exact(), CentredRig(), scene, Standing({0.0, 0.0, 5.0}));
  EXPECT_EQ(sweep.x.size(), 28800u);
  EXPECT_NEAR(sweep.t.back(), 1799 * kFiringPeriod + LaserDelay(15), 1e-6);
}

/// Range to an upright cylinder's side, in closed form; negative: none.
double CylinderRange(const Vector3d& o, const Vector3d& d, double radius) {
  const double a = d.head<2>().squaredNorm(), b = o.head<2>().dot(d.head<2>());
  const double disc = b * b - a * (o.head<2>().squaredNorm() - radius * radius);
  return disc < 0.0 ? -1.0 : (-b - std::sqrt(disc)) / a;
}

TEST(Lidar, CylinderRangesAreTheirClosedForm) {
  const Scene scene(
      World("ground: {height: -500}, cylinders: [{center: [0, 0], radius: 0.28, "
            "base: -5, height: 10}]"));
  const Vector3d p(2.1, 1.3, 0.2);
  const Quaterniond q(Eigen::AngleAxisd(0.3, Vector3d(0.2, -0.4, 1.0).normalized()));
  const Sweep sweep = SweepAlong(Exact(), CentredRig(), scene, Standing(p, q));
  EXPECT_GT(sweep.x.size(), 1000u);
  for (std::size_t i = 0; i < sweep.x.size(); ++i) {
    const Vector3d measured = Point(sweep, i), d = q * measured.normalized();
    const double range = CylinderRange(p, d, 0.28);
    if (range < 0.0 || (p + range * d).head<2>().dot(d.head<2>()) > -0.1) continue;  // grazing
    EXPECT_NEAR(measured.norm(), range, 4e-3);
  }
}

TEST(Lidar, PointsOfAnyAttitudeLieOnTheWorldsSurfaces) {
  world::Scenario world = World(
      "boxes: [{center: [4, 1, 1], size: [2, 1, 2], yaw_deg: 30}], "
      "cylinders: [{center: [-3, 2], radius: 0.4}], "
      "ellipsoids: [{center: [0, -4, 1], radii: [1, 0.5, 0.8], yaw_deg: -20}], "
      "walls: [{from: [-6, -6], to: [6, -6]}]");
  const Scene scene(world);
  const auto solids = world::StaticSolids(world);
  world::Rig rig;
  rig.lidar_rpy_deg = {3.0, -8.0, 20.0};
  for (int n = 0; n < 4; ++n) {
    const Vector3d p(0.3 * n, -0.5, 1.0 + 0.2 * n);
    const Quaterniond q(Eigen::AngleAxisd(0.2 * n, Vector3d(1.0, n, 0.5).normalized()));
    const Sweep sweep = SweepAlong(Exact(), rig, scene, Standing(p, q));
    ASSERT_GT(sweep.x.size(), 5000u);
    for (std::size_t i = 0; i < sweep.x.size(); ++i) {
      const Vector3d x = p + q * (rig.lidar_position + rig.R_BL() * Point(sweep, i));
      double apart = std::abs(x.z());
      for (const auto& solid : solids)
        apart = std::min(apart, std::abs(world::SignedDistance(solid, x)));
      EXPECT_LT(apart, 6e-3);  // the ellipsoid's triangles cut below its surface
    }
  }
}

/// Deskewed by the true motion, the points of a fast sweep lie on the walls; taken as if the sensor
/// had stood still, they do not.
TEST(Lidar, SensorMovesDuringTheSweep) {
  world::Scenario world = World(
      "walls: [{from: [-8, -6], to: [8, -6], height: 9}, {from: [-8, 6], to: [8, 6], height: 9}, "
      "{from: [-8, -6], to: [-8, 6], height: 9}, {from: [8, -6], to: [8, 6], height: 9}]");
  const Scene scene(world);
  const auto solids = world::StaticSolids(world);
  const Motion motion = [](double t) {
    return TimedPose{t, Vector3d(4.0 * t, -1.0 * t, 2.0 + 0.5 * t),
                     Quaterniond(Eigen::AngleAxisd(1.5 * t, Vector3d(0.3, 0.2, 1.0).normalized()))};
  };
  const world::Rig rig;
  const Sweep sweep = SweepAlong(Exact(), rig, scene, motion);
  const auto distance = [&](const TimedPose& pose, std::size_t i) {
    const Vector3d x = pose.p + pose.q * (rig.lidar_position + Point(sweep, i));
    double apart = std::abs(x.z());
    for (const auto& solid : solids)
      apart = std::min(apart, std::abs(world::SignedDistance(solid, x)));
    return apart;
  };
  double skewed = 0.0;
  for (std::size_t i = 0; i < sweep.x.size(); ++i) {
    EXPECT_LT(distance(motion(sweep.start + sweep.t[i]), i), 4e-3);
    skewed = std::max(skewed, distance(motion(0.0), i));
  }
  EXPECT_GT(skewed, 0.2);
}

TEST(Lidar, NoiseAndDropoutsHaveTheirFigures) {
  const Scene scene(World("ellipsoids: [{center: [0, 0, 0], radii: [20, 20, 20]}]"));
  LidarConfig config;
  config.noise = 0.03;
  config.dropout = 0.1;
  const auto motion = Standing({0.0, 0.0, 5.0});
  const Sweep exact = SweepAlong(Exact(), CentredRig(), scene, motion);
  const Sweep noisy = SweepAlong(config, CentredRig(), scene, motion);
  EXPECT_NEAR(static_cast<double>(noisy.x.size()), 0.9 * 28800, 250);
  double variance = 0.0, bias = 0.0;
  std::size_t k = 0;
  for (std::size_t i = 0; i < noisy.x.size(); ++i) {
    while (exact.t[k] != noisy.t[i] || exact.ring[k] != noisy.ring[i]) ++k;
    const double error = Point(noisy, i).norm() - Point(exact, k).norm();
    bias += error / static_cast<double>(noisy.x.size());
    variance += error * error / static_cast<double>(noisy.x.size());
  }
  EXPECT_NEAR(bias, 0.0, 1e-3);
  EXPECT_NEAR(std::sqrt(variance), 0.03, 1e-3);
}

TEST(Lidar, RangesOutsideItsLimitsAreLost) {
  const Scene scene(
      World("cylinders: [{center: [0.6, 0], radius: 0.28}], "
            "walls: [{from: [30, -50], to: [30, 50], height: 30}]"));
  LidarConfig config = Exact();
  config.max_range = 29.0;
  const Sweep sweep = SweepAlong(config, CentredRig(), scene, Standing({0.0, 0.0, 1.0}));
  for (std::size_t i = 0; i < sweep.x.size(); ++i) {
    EXPECT_GE(Point(sweep, i).norm(), 0.5);
    EXPECT_LE(Point(sweep, i).norm(), 29.001);
  }
}

TEST(Lidar, SweepsFollowEachOtherAtTheirRate) {
  const Scene scene(World("ground: {height: 0}"));
  Lidar lidar(Exact(), CentredRig(), 1);
  std::vector<double> starts;
  for (int tick = 0; tick < 100; ++tick) {
    const double t = 0.005 * tick;
    lidar.Advance(
        {{t, {0, 0, 1}, Quaterniond::Identity()}, {t + 0.005, {0, 0, 1}, Quaterniond::Identity()}},
        scene);
    if (const auto sweep = lidar.Take()) starts.push_back(sweep->start);
  }
  ASSERT_EQ(starts.size(), 5u);
  for (std::size_t i = 0; i < starts.size(); ++i)
    EXPECT_NEAR(starts[i], 0.1 * static_cast<double>(i), 1e-9);
}

TEST(Lidar, MovingThingsAreSeenWhereTheyAre) {
  world::Scenario world = World("ground: {height: -500}");
  world::MoverSpec mover;
  mover.size = {2.0, 1.0, 2.0};
  mover.waypoints = {{5.0, -10.0, 1.0}, {5.0, 10.0, 1.0}};
  mover.speed = 4.0;
  world.movers = {mover};
  Scene scene(world);
  for (const double t : {1.0, 2.5, 4.0}) {
    scene.MoveTo(t);
    const auto solid = world::MoverAt(mover, t).solid;
    const Sweep sweep = SweepAlong(Exact(), CentredRig(), scene, Standing({0.0, 0.0, 1.0}));
    ASSERT_GT(sweep.x.size(), 100u);
    for (std::size_t i = 0; i < sweep.x.size(); ++i) {
      const Vector3d x = Vector3d(0.0, 0.0, 1.0) + Point(sweep, i);
      EXPECT_NEAR(world::SignedDistance(solid, x), 0.0, 3e-3);
    }
  }
}

}  // namespace
}  // namespace chase::simulator
