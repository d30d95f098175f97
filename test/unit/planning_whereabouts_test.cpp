// Where a lost target may be, and where to look for it: against targets that do as they like.
#include <gtest/gtest.h>

#include <cmath>
#include <ctime>

#include "common/world/random.h"
#include "services/planning/whereabouts.h"

namespace chase::planning {
namespace {

constexpr double kStep = 0.05;  // s
const View kCamera{0.7, 0.35, 0.85};
const Eigen::Vector3d kEye(0.0, 0.0, 1.2);

/// A wall of flat ellipsoids from a to b.
std::vector<world::Obstacle> Wall(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  std::vector<world::Obstacle> wall;
  const int n = static_cast<int>(std::ceil((b - a).norm() / 0.5));
  const double turn = std::atan2((b - a).y(), (b - a).x());
  const Eigen::Matrix3d R = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d r(0.5, 0.1, 3.0);
  for (int i = 0; i <= n; ++i) {
    const Eigen::Vector2d p = a + (b - a) * i / n;
    world::Obstacle o;
    o.center = world::Trajectory::Constant({p.x(), p.y(), 1.0}, 0.0, 100.0);
    o.shape = R * r.cwiseAbs2().cwiseInverse().asDiagonal() * R.transpose();
    wall.push_back(o);
  }
  return wall;
}

TEST(Whereabouts, LieWithinReachAndMostlyAhead) {
  Whereabouts where;
  where.Begin(0.0, {3.0, 0.0, 0.5}, {1.5, 0.0, 0.0}, 1.5);
  where.Advance(2.0, {}, {100.0, 0.0, 1.2}, 0.0, kCamera);
  const Eigen::Vector3d place = where.Likeliest(1.0);
  EXPECT_GT(place.x(), 3.0);
  EXPECT_LT((place - Eigen::Vector3d(3.0, 0.0, 0.5)).norm(), 1.25 * 1.5 * 2.0);
  EXPECT_DOUBLE_EQ(place.z(), 0.5);
}

TEST(Whereabouts, WhatWasSeenEmptyIsNotLookedAtAgain) {
  Whereabouts where;
  where.Begin(0.0, {3.0, 2.0, 0.5}, {0.5, 0.0, 0.0}, 0.0);
  where.Advance(0.3, {}, kEye, M_PI, kCamera);
  const Whereabouts::Gaze there = where.BestGaze(M_PI, 1.5, kCamera);
  EXPECT_NEAR(there.yaw, std::atan2(2.0, 3.0), 0.5);
  EXPECT_GT(there.share, 0.99);
  for (double t = 0.3; t < 4.0; t += kStep) where.Advance(t, {}, kEye, 0.0, kCamera);
  EXPECT_GT(where.BestGaze(0.0, 1.5, kCamera).yaw, 0.4)
      << "towards the edge that it may have left by";
}

TEST(Whereabouts, GoThroughNoWallAndHideBehindIt) {
  const auto wall = Wall({4.0, -6.0}, {4.0, 6.0});
  Whereabouts where;
  where.Begin(0.0, {6.0, 0.0, 0.5}, {1.0, 0.0, 0.0}, 1.0);
  for (double t = 0.0; t < 4.0; t += kStep) where.Advance(t, wall, kEye, 0.0, kCamera);
  EXPECT_LT(where.BestGaze(0.0, 1.5, kCamera).share, 0.1) << "behind the wall none is seen";
  EXPECT_GT(where.Likeliest(1.5).x(), 4.0);
}

// The ellipsoid about a long wall bulges far beyond it.
TEST(Whereabouts, AreSeenBesideALongWall) {
  world::Obstacle wall;
  wall.solid = world::Obstacle::Solid::kBox;
  wall.half = {0.1, 8.0, 2.0};
  wall.center = world::Trajectory::Constant({0.6, 0.0, 1.0}, 0.0, 100.0);
  wall.shape = Eigen::Vector3d(1.0, 9.0, 3.0).cwiseAbs2().cwiseInverse().asDiagonal();
  for (const bool beyond : {false, true}) {
    Whereabouts where;
    where.Begin(0.0, {beyond ? 4.0 : -4.0, 3.0, 0.5}, {0.0, 0.3, 0.0}, 0.3);
    for (double t = 0.0; t < 1.0; t += kStep) where.Advance(t, {wall}, kEye, 0.0, kCamera);
    const Whereabouts::Gaze gaze = where.BestGaze(0.0, 1.5, kCamera);
    EXPECT_NEAR(gaze.share, beyond ? 0.0 : 1.0, 0.05);
    if (!beyond) {
      EXPECT_NEAR(gaze.yaw, std::atan2(3.3, -4.0), 0.4);
    }
  }
}

/// Processor time of an update at t, s, of a search that was begun at 0 and had come to `before`.
double UpdateTime(double before, double t) {
  const auto walls = Wall({20.0, -20.0}, {20.0, 20.0});
  Whereabouts where;
  where.Begin(0.0, {3.0, 0.0, 0.5}, {1.0, 0.0, 0.0}, 1.0);
  where.Advance(before, walls, kEye, 0.0, kCamera);
  const std::clock_t begun = std::clock();
  where.Advance(t, walls, kEye, 0.0, kCamera);
  EXPECT_LE((where.Likeliest(1.0) - Eigen::Vector3d(3.0, 0.0, 0.5)).norm(), 1.25 * t);
  return static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC;
}

TEST(Whereabouts, AreSoonFoundAfterALongTimeWithoutASearch) {
  const double two_seconds = UpdateTime(0.0, 2.0);
  EXPECT_LT(UpdateTime(0.0, 600.0), 10.0 * two_seconds) << "begun late";
  EXPECT_LT(UpdateTime(2.0, 600.0), 10.0 * two_seconds) << "gone on with late";
}

/// A target passes the camera, leaves the image and turns as it likes. Time until it is in the
/// image again, turning at `rate` to the best gaze or ever to one side; 20 s at most.
double TimeToFind(uint64_t seed, bool best) {
  constexpr double kRate = 1.2;  // rad/s
  world::Random random(seed, 3);
  Eigen::Vector2d p(random.Uniform(0.5, 1.5), random.Uniform(-1.5, 1.5));
  double heading = random.Uniform(-M_PI, M_PI), yaw = 0.0;
  const double speed = random.Uniform(0.5, 3.0);
  Whereabouts where;
  where.Begin(0.0, {p.x(), p.y(), 0.5}, {speed * std::cos(heading), speed * std::sin(heading), 0.0},
              speed);
  double rate = 0.0;
  for (double t = 0.0; t < 20.0; t += kStep) {
    rate += 0.3 * (random.Uniform(-2.0, 2.0) - rate);
    heading += rate * kStep;
    p += speed * kStep * Eigen::Vector2d(std::cos(heading), std::sin(heading));
    const double off = std::remainder(std::atan2(p.y(), p.x()) - yaw, 2.0 * M_PI);
    const double below = (kEye.z() - 0.5) / p.norm();
    if (t > 0.5 && std::abs(std::tan(off)) < kCamera.side && std::abs(off) < M_PI_2 &&
        below < kCamera.down)
      return t;
    where.Advance(t, {}, kEye, yaw, kCamera);
    const double turn =
        best ? std::remainder(where.BestGaze(yaw, kRate, kCamera).yaw - yaw, 2.0 * M_PI) : 10.0;
    yaw += std::clamp(turn, -kRate * kStep, kRate * kStep);
  }
  return 20.0;
}

TEST(Whereabouts, FindSoonerThanTurningRound) {
  double best = 0.0, round = 0.0;
  int late = 0;
  constexpr int kFlights = 200;
  for (uint64_t seed = 1; seed <= kFlights; ++seed) {
    const double t = TimeToFind(seed, true);
    best += t / kFlights, round += TimeToFind(seed, false) / kFlights;
    late += t > 4.0 ? 1 : 0;
  }
  EXPECT_LT(best, 0.6 * round) << best << " s against " << round << " s";
  EXPECT_LE(late, kFlights / 20);
}

}  // namespace
}  // namespace chase::planning
