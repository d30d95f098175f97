// Odometry in the simulator's worlds, in one process. CHASE_ODOMETRY_LAYOUTS=200 asks for more of
// the random ones, CHASE_ODOMETRY_FIRST for other seeds; figures are printed then.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <vector>

#include "common/world/random.h"
#include "test/odometry/live_trial.h"

namespace chase::odometry {
namespace {

using trial::FlyLive;
using trial::LiveFigures;
using trial::LiveOptions;

int Environment(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text ? std::atoi(text) : otherwise;
}

/// The layouts to fly, `usual` many from `first` on unless others are asked for.
std::vector<int> Seeds(int usual, int first = 1) {
  std::vector<int> seeds(static_cast<size_t>(Environment("CHASE_ODOMETRY_LAYOUTS", usual)));
  std::iota(seeds.begin(), seeds.end(), Environment("CHASE_ODOMETRY_FIRST", first));
  return seeds;
}

LiveFigures Shown(const std::string& what, const LiveFigures& figures) {
  if (std::getenv("CHASE_ODOMETRY_LAYOUTS"))
    fmt::print("{{\"what\":\"{}\",{}}}\n", what, trial::Text(figures));
  std::fflush(stdout);
  return figures;
}

/// Over all flights, on each axis: the error lies within three standard deviations for
/// `covered_share` of the time, and the median standard deviation is no more than `caution` times
/// the RMS error.
void ExpectHonest(const std::vector<LiveFigures>& flights, double covered_share, double caution) {
  for (int axis = 0; axis < 3; ++axis) {
    double covered = 0.0, squares = 0.0;
    std::vector<double> sigma;
    for (const LiveFigures& f : flights) {
      covered += f.covered[axis] / static_cast<double>(flights.size());
      squares += f.rms[axis] * f.rms[axis] / static_cast<double>(flights.size());
      sigma.push_back(f.sigma[axis]);
    }
    std::sort(sigma.begin(), sigma.end());
    EXPECT_GE(covered, covered_share) << "axis " << axis;
    EXPECT_LE(sigma[sigma.size() / 2], caution * std::sqrt(squares)) << "axis " << axis;
  }
}

/// After the LiDAR's return; `tilt`: the most of it, deg.
void ExpectBack(const LiveFigures& figures, double tilt) {
  EXPECT_LE(figures.velocity_back.value_or(HUGE_VAL), 0.5);
  EXPECT_LE(figures.tilt.value_or(HUGE_VAL), tilt);
}

/// From power-on through take-off into the first metres of way, whatever grows there.
TEST(OdometryLive, StartsAnywhere) {
  for (const int seed : Seeds(3, 7)) {
    world::Random random(static_cast<uint64_t>(seed), 5);
    const int trees = seed % 8 == 0 ? 0 : static_cast<int>(random.Uniform(0.0, 241.0));
    const double roughness = random.Uniform(0.0, 0.3);
    const std::string what =
        fmt::format("seed {} trees {} roughness {:.2f}", seed, trees, roughness);
    LiveOptions options;
    options.seed = seed;
    options.duration = 10.0;
    const LiveFigures figures =
        Shown(what, FlyLive(trial::Meadow(trees, roughness, static_cast<uint64_t>(seed)), options));
    EXPECT_EQ(figures.refused, 0) << what;
    EXPECT_EQ(figures.lost, 0) << what;
    EXPECT_EQ(figures.epochs, 0) << what;
    if (trees >= 10) {
      EXPECT_LT(figures.aligned, 0.05) << what;
    }
  }
}

/// From the ground a corridor shows the feet of its walls; the climb shows the rest of it.
TEST(OdometryLive, ClimbsBetweenWalls) {
  for (const int seed : Seeds(3, 9)) {
    LiveOptions options;
    options.seed = seed;
    options.course = "hover";
    options.duration = 10.0;
    const LiveFigures figures =
        Shown(fmt::format("passage, seed {}", seed),
              FlyLive(trial::Passage(static_cast<uint64_t>(seed)), options));
    EXPECT_EQ(figures.refused, 0) << seed;
    EXPECT_EQ(figures.epochs, 0) << seed;
    EXPECT_LT(figures.worst, 0.05) << seed;
  }
}

/// On ground this steep a leg of the level body is in the ground at power-on: it is thrown off and
/// coasts while the alignment runs.
TEST(OdometryLive, StartsOnGroundThatThrowsItOff) {
  std::vector<LiveFigures> flights;
  for (const int seed : Seeds(2)) {
    world::Random random(static_cast<uint64_t>(seed), 6);
    const double way = random.Uniform(-M_PI, M_PI);
    world::Scenario scenario = trial::Meadow(60, 0.05, static_cast<uint64_t>(seed));
    scenario.world.ground.slope = 0.21 * Eigen::Vector2d(std::cos(way), std::sin(way));
    Eigen::Vector3d& start = scenario.chaser.start;
    start.z() += scenario.world.ground.slope.dot(start.head<2>());
    LiveOptions options;
    options.seed = seed;
    options.duration = 8.0;
    options.judge_from = 1.0;
    flights.push_back(Shown(fmt::format("steep, seed {}", seed), FlyLive(scenario, options)));
    EXPECT_LT(flights.back().worst, 0.1) << seed;
    EXPECT_LT(flights.back().end, 0.05) << seed;
    EXPECT_EQ(flights.back().lost, 0) << seed;
  }
  ExpectHonest(flights, 0.95, 6.0);
}

TEST(OdometryLive, BareStreetIsSaidToHoldNothingAlongIt) {
  std::vector<LiveFigures> flights;
  for (const int seed : Seeds(3))
    for (const bool posts : {false, true}) {
      LiveOptions options;
      options.seed = seed;
      options.duration = posts ? 40.0 : 30.0;
      flights.push_back(
          Shown(posts ? "street, posts" : "street", FlyLive(trial::BareStreet(posts), options)));
    }
  ExpectHonest(flights, 0.99, 3.0);
}

TEST(OdometryLive, FlatFieldIsSaidToHoldNothingAcross) {
  std::vector<LiveFigures> flights;
  for (const int seed : Seeds(3)) {
    LiveOptions options;
    options.seed = seed;
    options.duration = 25.0;
    flights.push_back(Shown("field", FlyLive(trial::Meadow(0, 0.0, 1), options)));
  }
  ExpectHonest(flights, 0.99, 3.0);
}

/// On its legs the body sees the ground near by and the rest far away: the one holds its tilt.
TEST(OdometryLive, IsHealthyOnTheGroundBeforeTakeOff) {
  for (const int seed : Seeds(3)) {
    LiveOptions options;
    options.seed = seed;
    options.course = "rest";
    options.duration = 8.0;
    options.judge_from = 2.0;
    const LiveFigures figures =
        Shown("stands", FlyLive(trial::Square(static_cast<uint64_t>(seed)), options));
    EXPECT_EQ(figures.degraded, 0) << seed;
    EXPECT_LT(figures.worst, 0.02) << seed;
  }
}

/// Drivers start in any order: an IMU that is heard after the first sweeps finds a body at rest.
TEST(OdometryLive, TheImuMayComeAfterTheFirstSweeps) {
  for (const int seed : Seeds(8)) {
    world::Random random(static_cast<uint64_t>(seed), 8);
    LiveOptions options;
    options.seed = seed;
    options.course = "rest";
    options.imu_from = random.Uniform(0.1, 4.0);
    options.duration = 15.0;
    options.judge_from = options.imu_from + 1.5;
    const LiveFigures figures = Shown(
        "late imu",
        FlyLive(trial::Meadow(10 + 10 * (seed % 7), 0.1, static_cast<uint64_t>(seed)), options));
    EXPECT_EQ(figures.degraded, 0) << seed;
    EXPECT_LT(figures.moved, 0.02) << seed;
    EXPECT_LT(figures.turned, 1.5) << seed << ", that the accelerometer's bias may be";
  }
}

TEST(OdometryLive, StandingWithoutImuStaysWhereItIs) {
  std::vector<LiveFigures> flights;
  for (const int seed : Seeds(3)) {
    LiveOptions options;
    options.seed = seed;
    options.course = "rest";
    options.imu = false;
    options.duration = 30.0;
    options.judge_from = 1.0;
    flights.push_back(Shown(
        "no imu",
        FlyLive(trial::Meadow(40 * (1 + seed % 5), 0.1, static_cast<uint64_t>(seed)), options)));
    EXPECT_LT(flights.back().worst, 0.03) << seed;
  }
  // While it is young the map creeps by a few millimetres, which nothing models: 0.99 is missed.
  ExpectHonest(flights, 0.95, 6.0);
}

TEST(OdometryLive, StandsStillAfterLanding) {
  for (const int seed : Seeds(1))
    for (const double out : {0.0, 3.0, 10.0}) {
      LiveOptions options;
      options.seed = seed;
      options.course = "hover";
      options.land_at = 12.0;
      options.judge_from = 20.0;
      options.lidar_out_from = 22.0;
      options.lidar_out_to = 22.0 + out;
      options.duration = out > 0.0 ? 40.0 : 80.0;
      const LiveFigures figures =
          Shown(fmt::format("landed {}", out),
                FlyLive(trial::Meadow(60, 0.1, static_cast<uint64_t>(seed)), options));
      EXPECT_LT(figures.moved, 0.1) << out;
      EXPECT_EQ(figures.lost, 0) << out;
      EXPECT_EQ(figures.epochs, 0) << out;
      ExpectBack(figures, 0.3);
    }
}

TEST(OdometryLive, VelocityIsUsableSoonAfterASecondWithoutSweeps) {
  for (const int seed : Seeds(2)) {
    LiveOptions options;
    options.seed = seed;
    options.lidar_out_from = 12.0;
    options.lidar_out_to = 13.0;
    const LiveFigures figures =
        Shown("air 1", FlyLive(trial::Meadow(60, 0.1, static_cast<uint64_t>(seed)), options));
    ExpectBack(figures, 0.3);
    EXPECT_LT(figures.aligned, 0.1);
  }
}

/// Ten seconds in the air on inertia alone, off by as much as it is doubted for: the map is given
/// up, the error is not forgotten.
TEST(OdometryLive, WhatWasLostBeforeARestartIsNotForgotten) {
  std::vector<LiveFigures> flights;
  for (const int seed : Seeds(4)) {
    world::Random random(static_cast<uint64_t>(seed), 7);
    LiveOptions options;
    options.seed = seed;
    for (double& a : options.accel_fault) a = FilterConfig{}.doubt_accel * random.Gaussian();
    options.lidar_out_from = 12.0;
    options.lidar_out_to = 22.0;
    options.judge_from = 22.5;
    options.duration = 32.0;
    flights.push_back(
        Shown("air 10", FlyLive(trial::Meadow(60, 0.1, static_cast<uint64_t>(seed)), options)));
    ExpectBack(flights.back(), 0.6);
  }
  ExpectHonest(flights, 0.99, 3.0);
}

}  // namespace
}  // namespace chase::odometry
