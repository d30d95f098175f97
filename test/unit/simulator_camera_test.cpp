#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/world/random.h"
#include "common/world/scenario.h"
#include "services/simulator/camera.h"
#include "services/simulator/projection.h"
#include "services/simulator/simulator.h"

namespace chase::simulator {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// The target 4 m ahead of the origin on even ground, and more parts of the world.
world::Scenario World(const std::string& parts) {
  return world::ParseScenario(
      "name: test\ntarget: {waypoints: [[4, 0], [5, 0]]}\nworld: {" + parts + "}\n", "test");
}

CameraConfig Clean() {
  CameraConfig config;
  config.noise = config.exposure_variation = 0.0;
  return config;
}

/// One frame and all that belongs to it.
struct Shot {
  Shot(const world::Scenario& world, const Vector3d& p_WB, const Quaterniond& q_WB,
       const CameraConfig& config = Clean(), uint64_t seed = 1)
      : scene(world),
        target(Actors(world).Target(0.0)),
        camera(config, rig, {1.0, 0.45, 0.05}, seed) {
    scene.MoveTo(0.0);
    p_WC = p_WB + q_WB * rig.camera_position;
    R_WC = q_WB.toRotationMatrix() * rig.R_BC();
    image = camera.Render(p_WB, q_WB, 0.0, scene, target.cylinder);
    view = camera.View();
  }
  Vector3d Direction(int u, int v) const {
    return R_WC * Vector3d((u - rig.center_u_px) / rig.focal_px,
                           (v - rig.center_v_px) / rig.focal_px, 1.0);
  }
  bool Orange(int u, int v) const {
    const uint8_t* p = &image.rgb[static_cast<std::size_t>(3 * (v * image.width + u))];
    return p[0] > 2 * p[2] + 20 && p[0] > p[1] + 20;
  }

  world::Rig rig;
  Scene scene;
  TargetState target;
  Camera camera;
  Vector3d p_WC;
  Eigen::Matrix3d R_WC;
  Image image;
  TargetView view;
};

Quaterniond Yaw(double angle) { return Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitZ())); }

/// First hit of a ray with a solid by marching its signed distance; infinity: none.
double March(const world::Solid& solid, const Vector3d& origin, const Vector3d& direction) {
  double t = 0.0;
  const Vector3d d = direction.normalized();
  for (int i = 0; i < 200 && t < 200.0; ++i) {
    const double step = world::SignedDistance(solid, origin + t * d);
    if (step < 1e-6) return t;
    t += step;
  }
  return std::numeric_limits<double>::infinity();
}

TEST(Camera, ImageHasTheRigsSize) {
  const Shot shot(World(""), {0.0, 0.0, 1.0}, Yaw(0.0));
  EXPECT_EQ(shot.image.width, 376);
  EXPECT_EQ(shot.image.height, 240);
  EXPECT_EQ(shot.image.rgb.size(), 376u * 240u * 3u);
}

/// Every pixel is the target's where an independent ray marcher says so, but for its very edge.
TEST(Camera, TargetPixelsAgreeWithRayMarching) {
  const auto world = World("cylinders: [{center: [2, 0.12], radius: 0.1}]");
  const Shot shot(world, {0.0, 0.1, 1.2}, Yaw(0.05));
  const auto solids = world::StaticSolids(world);
  int expected = 0, alone = 0, differ = 0;
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < 376; ++u) {
      const Vector3d d = shot.Direction(u, v);
      const double target = March(shot.target.cylinder, shot.p_WC, d);
      double other = March(shot.target.carrier, shot.p_WC, d);
      for (const auto& solid : solids) other = std::min(other, March(solid, shot.p_WC, d));
      const bool seen = std::isfinite(target) && target < other;
      alone += std::isfinite(target);
      expected += seen;
      differ += seen != shot.Orange(u, v);
    }
  ASSERT_GT(expected, 100);
  ASSERT_LT(expected, alone - 100);
  EXPECT_LE(differ, 4);
  EXPECT_NEAR(shot.view.visible_share, static_cast<double>(expected) / alone, 0.01);
}

TEST(Camera, CentreProjectsToThePixelThatSeesIt) {
  for (const double yaw : {-0.5, -0.2, 0.0, 0.3}) {
    const Shot shot(World(""), {0.3, 0.2, 1.3}, Yaw(yaw));
    const Vector3d p_C = shot.R_WC.transpose() * (shot.target.center - shot.p_WC);
    const double u = shot.rig.center_u_px + shot.rig.focal_px * p_C.x() / p_C.z();
    const double v = shot.rig.center_v_px + shot.rig.focal_px * p_C.y() / p_C.z();
    EXPECT_NEAR(shot.view.px.x(), u, 1e-9);
    EXPECT_NEAR(shot.view.px.y(), v, 1e-9);
    ASSERT_TRUE(shot.view.in_image);
    EXPECT_TRUE(shot.Orange(static_cast<int>(std::lround(u)), static_cast<int>(std::lround(v))));
    EXPECT_DOUBLE_EQ(shot.view.visible_share, 1.0);
  }
}

/// A target to the left appears left, and a higher camera sees it lower: no axis is mirrored.
TEST(Camera, LeftIsLeftAndDownIsDown) {
  const Shot ahead(World(""), {0.0, 0.0, 1.2}, Yaw(0.0));
  const Shot right(World(""), {0.0, 0.0, 1.2}, Yaw(0.2));
  const Shot high(World(""), {0.0, 0.0, 1.6}, Yaw(0.0));
  EXPECT_GT(right.view.px.x(), ahead.view.px.x() + 30.0);
  EXPECT_GT(high.view.px.y(), ahead.view.px.y() + 10.0);
}

TEST(Camera, TargetOutsideOrBehindIsNotInTheImage) {
  const Shot beside(World(""), {0.0, 0.0, 1.2}, Yaw(1.0));
  EXPECT_FALSE(beside.view.in_image);
  EXPECT_EQ(beside.view.visible_share, 0.0);
  const Shot behind(World(""), {0.0, 0.0, 1.2}, Yaw(3.14));
  EXPECT_FALSE(behind.view.in_image);
  EXPECT_EQ(behind.view.px, Eigen::Vector2d(-1.0, -1.0));
}

TEST(Camera, WallHidesTheTargetWhole) {
  const Shot shot(World("walls: [{from: [2, -3], to: [2, 3]}]"), {0.0, 0.0, 1.2}, Yaw(0.0));
  EXPECT_TRUE(shot.view.in_image);
  EXPECT_EQ(shot.view.visible_share, 0.0);
}

TEST(Camera, BoxOfTheTargetEnclosesItsPixelsTightly) {
  const Shot shot(World(""), {0.5, 0.3, 1.4}, Yaw(-0.1));
  const PixelBox box = ProjectedBox(shot.rig, {shot.p_WC, shot.R_WC}, shot.target.cylinder);
  int left = 999, right = -1, top = 999, bottom = -1;
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < 376; ++u)
      if (shot.Orange(u, v)) {
        left = std::min(left, u), right = std::max(right, u);
        top = std::min(top, v), bottom = std::max(bottom, v);
      }
  EXPECT_NEAR(box.left, left, 1.0);
  EXPECT_NEAR(box.right, right, 1.0);
  EXPECT_NEAR(box.top, top, 1.0);
  EXPECT_NEAR(box.bottom, bottom, 1.0);
}

/// Eight rays through neighbours in a row of the image.
RayPacket Packet(const world::Rig& rig, const Viewpoint& view, int u, int v) {
  RayPacket rays;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3f p = view.p_WC.cast<float>();
    const Eigen::Vector3f d = (view.R_WC * Vector3d((u + i - rig.center_u_px) / rig.focal_px,
                                                    (v - rig.center_v_px) / rig.focal_px, 1.0))
                                  .cast<float>();
    rays.ox[i] = p.x(), rays.oy[i] = p.y(), rays.oz[i] = p.z();
    rays.dx[i] = d.x(), rays.dy[i] = d.y(), rays.dz[i] = d.z();
  }
  return rays;
}

TEST(Camera, WhatMovesIsSeenWithinItsRectangleOnly) {
  const auto world = world::ParseScenario(
      "name: test\ntarget: {waypoints: [[4, 0], [5, 0]], carrier_size: [0.8, 0.6, 0.4]}\n"
      "movers:\n  - {shape: box, size: [2, 1, 1.5], waypoints: [[2, 3, 1], [6, 5, 2]], speed: 1}\n"
      "  - {shape: ellipsoid, size: [1, 2, 1.5], waypoints: [[5, -3, 1], [1, -4, 1]], speed: 1}\n",
      "test");
  Scene scene(world);
  const world::Rig rig;
  world::Random random(17);
  int seen = 0, spared = 0;
  for (int shot = 0; shot < 200; ++shot) {
    scene.MoveTo(random.Uniform(0.0, 4.0));
    const auto& solids = scene.MovingSolids();
    Viewpoint view;
    view.p_WC = solids[static_cast<std::size_t>(shot) % solids.size()].center;
    for (int i = 0; i < 3; ++i) view.p_WC[i] += random.Uniform(-2.5, 2.5);
    const Vector3d axis(random.Gaussian(), random.Gaussian(), random.Gaussian());
    view.R_WC = Eigen::AngleAxisd(random.Uniform(-3.1, 3.1), axis.normalized()).matrix();
    for (int ray = 0; ray < 300; ++ray) {
      const int u = static_cast<int>(random.Next() % 368),
                v = static_cast<int>(random.Next() % 240);
      HitPacket hits;
      scene.Trace(Packet(rig, view, u, v), &hits);
      for (int i = 0; i < 8; ++i) {
        const bool within = std::any_of(solids.begin(), solids.end(), [&](const auto& solid) {
          const PixelBox box = OutlineOf(rig, view, solid).box;
          return box.left <= u + i && u + i <= box.right && box.top <= v && v <= box.bottom;
        });
        const bool mover = hits.material[i] >= Material::kMover;
        EXPECT_TRUE(within || !mover) << "seed 17, shot " << shot << ", " << u + i << " " << v;
        seen += mover, spared += !within;
      }
    }
  }
  EXPECT_GT(seen, 1000);
  EXPECT_GT(spared, 1000);
}

TEST(Camera, NoiseHasItsSpreadAndFollowsTheSeed) {
  CameraConfig config = Clean();
  config.noise = 4.0;
  const auto world = World("");
  const Shot clean(world, {0.0, 0.0, 1.2}, Yaw(0.0), Clean());
  const Shot noisy(world, {0.0, 0.0, 1.2}, Yaw(0.0), config);
  const Shot again(world, {0.0, 0.0, 1.2}, Yaw(0.0), config);
  const Shot other(world, {0.0, 0.0, 1.2}, Yaw(0.0), config, 2);
  EXPECT_EQ(noisy.image.rgb, again.image.rgb);
  EXPECT_NE(noisy.image.rgb, other.image.rgb);
  double variance = 0.0, mean = 0.0, n = 0.0;
  for (std::size_t i = 0; i < clean.image.rgb.size(); ++i) {
    if (clean.image.rgb[i] < 30 || clean.image.rgb[i] > 220) continue;
    const double error = noisy.image.rgb[i] - clean.image.rgb[i];
    mean += error, variance += error * error, n += 1.0;
  }
  EXPECT_NEAR(mean / n, 0.0, 0.2);
  EXPECT_NEAR(std::sqrt(variance / n), 4.0, 0.2);
}

/// A box that stands in the open is seen wholly whichever way it is turned.
TEST(Camera, TargetOfAnyShapeIsSeenWhollyInTheOpen) {
  for (const char* shape : {"box", "sphere"})
    for (const double heading : {0.0, 0.4, 0.8}) {
      world::Scenario world;
      world.target.shape = shape;
      world.target.radius = 0.25;
      world.target.base = 0.5;
      world.target.carrier_size.setZero();
      world.target.waypoints = {{3.0, 0.0}, {3.0 + std::cos(heading), std::sin(heading)}};
      const Shot shot(world, {0.0, 0.0, 1.0}, Yaw(0.0));
      EXPECT_NEAR(shot.view.visible_share, 1.0, 1e-9) << shape << " " << heading;
    }
}

}  // namespace
}  // namespace chase::simulator
