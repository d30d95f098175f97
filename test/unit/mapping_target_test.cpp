#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/world/ages.h"
#include "mapping_metrics.h"
#include "mapping_world.h"
#include "services/mapping/mapper.h"

namespace chase::mapping {
namespace {

/// The gym with a robot (box) that carries a cylinder.
testing::World GymWithTarget(const Eigen::Vector2d& at) {
  testing::World world = testing::Gym();
  world.boxes.push_back({{at.x(), at.y(), 0.15}, {0.25, 0.2, 0.15}});
  world.cylinders.push_back({at, 0.15, 0.3, 0.9});
  return world;
}

/// Between the pillars at up to 1 m/s.
Eigen::Vector2d TargetPath(double t) { return {1.5 + 0.8 * t, 4.2 + 0.5 * std::sin(0.7 * t)}; }

TargetEstimate Estimate(const Eigen::Vector2d& at, const Eigen::Vector2d& velocity, double t,
                        std::mt19937* random) {
  std::normal_distribution<double> noise(0.0, 0.03);
  TargetEstimate estimate;
  estimate.t = t;
  estimate.mean << at.x() + noise(*random), at.y() + noise(*random), 0.6;
  estimate.velocity << velocity, 0.0;
  estimate.sigma = 0.05;
  estimate.height = 0.6;
  return estimate;
}

bool Blocked(const ObstacleList& list, const Eigen::Vector2d& at, double t) {
  return testing::Holding(list.obstacles, {at.x(), at.y(), 0.6}, t) != nullptr;
}

TEST(MappingTarget, IsNeverAnObstacleWhileItIsTracked) {
  std::mt19937 random(6);
  Mapper mapper(MappingConfig{});
  for (int i = 0; i < 100; ++i) {
    const double t = 0.1 * i;
    const Eigen::Vector2d at = TargetPath(t), velocity(0.8, 0.35 * std::cos(0.7 * t));
    mapper.ObserveTarget(Estimate(at - 0.05 * velocity, velocity, t - 0.05, &random));
    const Eigen::Vector3d drone(at.x() - 2.5 + 2.2, at.y() - 1.8, 1.3);
    const auto list = mapper.Insert(testing::Scan(GymWithTarget(at), drone, t, {}, &random));
    EXPECT_FALSE(Blocked(list, at, t)) << t;
    EXPECT_EQ(list.n_moving, 0) << t;
  }
}

TEST(MappingTarget, IsClearedWhereItStoodBeforeItWasKnown) {
  std::mt19937 random(6);
  Mapper mapper(MappingConfig{});
  const Eigen::Vector2d at(5.0, 4.6);
  const testing::World world = GymWithTarget(at);
  bool blocked = false;
  for (int i = 0; i < 60; ++i) {
    const double t = 0.1 * i;
    if (i >= 40) mapper.ObserveTarget(Estimate(at, {0, 0}, t, &random));
    const auto list = mapper.Insert(testing::Scan(world, {3.0, 4.0, 1.2}, t, {}, &random));
    if (i == 39) blocked = Blocked(list, at, t);
    if (i >= 40) {
      EXPECT_FALSE(Blocked(list, at, t)) << t;
    }
  }
  EXPECT_TRUE(blocked);
}

TEST(MappingTarget, StaysOutForAWhileAfterALoss) {
  std::mt19937 random(6);
  Mapper mapper(MappingConfig{});
  const auto place = [](double t) { return Eigen::Vector2d(4.0 + 0.5 * std::min(t, 3.0), 4.5); };
  for (int i = 0; i < 60; ++i) {
    const double t = 0.1 * i;
    if (t <= 3.0) mapper.ObserveTarget(Estimate(place(t), {t < 3.0 ? 0.5 : 0.0, 0}, t, &random));
    const auto list =
        mapper.Insert(testing::Scan(GymWithTarget(place(t)), {3.5, 2.5, 1.2}, t, {}, &random));
    if (t < 3.0 + TargetConfig{}.hold) {
      EXPECT_FALSE(Blocked(list, place(t), t)) << t;
    } else if (t > 5.5) {
      EXPECT_TRUE(Blocked(list, place(t), t)) << t;
    }
  }
}

/// Lost on its way to a pillar, it may have turned aside: its prediction runs through the pillar,
/// which is listed all the same, and so is what the pillar hides.
TEST(MappingTarget, WhatStandsWhereItIsOnlyPredictedStaysListed) {
  std::mt19937 random(6);
  Mapper mapper(MappingConfig{});
  const Eigen::Vector2d pillar = testing::GymPillars()[2], velocity(0.0, 1.0);
  const Eigen::Vector3d drone(pillar.x(), pillar.y() - 1.5, 1.3);
  const Eigen::Vector2d hidden(pillar.x(), pillar.y() + 0.8);
  constexpr double kLost = 3.0;
  for (int i = 0; i < 48; ++i) {
    const double t = 0.1 * i;
    const Eigen::Vector2d predicted = pillar + (t - kLost - 0.7) * velocity;
    TargetEstimate estimate = Estimate(predicted, velocity, t, &random);
    estimate.seen = t < kLost;
    if (t > 2.0) mapper.ObserveTarget(estimate);
    const testing::World world =
        t > 2.0 && estimate.seen ? GymWithTarget(predicted) : testing::Gym();
    const auto list = mapper.Insert(testing::Scan(world, drone, t, {}, &random));
    if (t <= kLost) continue;
    EXPECT_TRUE(Blocked(list, pillar, t)) << t;
    EXPECT_NE(testing::Holding(list.unseen, {hidden.x(), hidden.y(), 1.3}, t), nullptr) << t;
  }
}

TEST(MappingTarget, PassingNextToAPillarLeavesItWhole) {
  std::mt19937 random(6);
  Mapper mapper(MappingConfig{});
  const Eigen::Vector2d pillar = testing::GymPillars()[2];
  testing::HitCounter hits;
  for (int i = 0; i < 80; ++i) {
    const double t = 0.1 * i;
    const Eigen::Vector2d at(pillar.x() - 2.4 + 0.6 * t, pillar.y() + 0.28 + 0.3);
    if (i >= 20) mapper.ObserveTarget(Estimate(at, {0.6, 0}, t, &random));
    testing::Truth truth;
    const auto list = mapper.Insert(
        testing::Scan(GymWithTarget(at), {pillar.x() - 1.0, 5.5, 1.3}, t, {}, &random, &truth));
    if (i < 20) continue;
    EXPECT_NE(testing::Holding(list.obstacles, {pillar.x(), pillar.y(), 1.2}, t), nullptr) << t;
    EXPECT_FALSE(Blocked(list, at, t)) << t;
  }
}

/// As long as planning flies after it: then it is an obstacle like all else.
TEST(MappingTarget, PerceptionsOwnPredictionsCountForAWhileOnly) {
  const TargetConfig config;
  EXPECT_EQ(config.hold, world::kMostAge.target_unseen);
  TargetZone zone(config);
  TargetEstimate estimate;
  zone.Observe(estimate);
  estimate.seen = false;
  for (double t = 0.05; t < 10.0; t += 0.1) {
    estimate.t = t;
    zone.Observe(estimate);
    zone.MoveTo(t);
    EXPECT_EQ(zone.active(), t < config.hold) << t;
  }
  estimate.seen = true;
  zone.Observe(estimate);
  zone.MoveTo(estimate.t);
  EXPECT_TRUE(zone.active());
}

}  // namespace
}  // namespace chase::mapping
