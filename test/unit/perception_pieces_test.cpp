// Pieces of one blob, and what LiDAR points tell for or against one of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "perception_world.h"
#include "services/perception/belief/candidate.h"
#include "services/perception/place/localiser.h"
#include "services/perception/place/target_points.h"
#include "services/perception/sight/color_detector.h"
#include "services/perception/sight/silhouette.h"

namespace chase::perception {
namespace {

using Eigen::Vector3d;
using perception_test::Renderer;
using perception_test::StillWorld;
using perception_test::Thing;

const Vector3d kTarget(3.0, 0.0, 0.55), kLidar(0.0, 0.0, 1.0);

FitInput Predicted() {
  FitInput input;
  input.prior.mean.head<3>() = kTarget;
  input.prior.covariance *= 1e-4;
  return input;
}

TargetPoint PointAt(const Vector3d& p_W, double age = 0.0) {
  return {p_W, kLidar, age, (p_W - kLidar).norm()};
}

/// Share of radius and half height off the centre at which the ray passes nearest, step by step:
/// where it is nearest to the axis, and the least of all places.
std::pair<double, double> Passes(const TargetPoint& p, const Vector3d& center) {
  double nearest = 1e9, at_nearest = 0.0, least = 1e9;
  for (double s = 0.0; s <= 1.0; s += 2e-4) {
    const Vector3d d = p.p_WL + s * (p.p_W - p.p_WL) - center;
    const double beside = d.head<2>().norm() / 0.15, above = std::abs(d.z()) / 0.25;
    if (beside < nearest) nearest = beside, at_nearest = std::max(beside, above);
    least = std::min(least, std::max(beside, above));
  }
  return {at_nearest, least};
}

TEST(PerceptionRays, OnlyThoseThroughThePlacedTargetCount) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  FitInput input = Predicted();
  TargetGaussian placed = input.prior;
  placed.mean << 3.0, 0.2, 0.55, 0.0, 1.0, 0.0;
  Clusters hits(2), before(1), on(1);
  int through = 0, beside = 0;
  for (int i = 0; i < 600; ++i) {
    const auto p =
        PointAt({4.0, 0.2 + 0.5 * u(random), 0.4 + 0.6 * u(random)}, 0.05 + 0.05 * u(random));
    const auto [at_nearest, least] = Passes(p, placed.position() - p.age * placed.velocity());
    if (at_nearest >= 0.75 && least <= 1.0) continue;  // its rim
    (at_nearest < 0.75 ? through : beside) += 1;
    hits[static_cast<size_t>(i % 2)].push_back(p);
    before[0].push_back(PointAt(kLidar + 0.6 * (p.p_W - kLidar), p.age));
    on[0].push_back(PointAt(kLidar + 0.74 * (p.p_W - kLidar), p.age));
  }
  ASSERT_GT(through, 30);
  ASSERT_GT(beside, 200);
  EXPECT_EQ(RaysThrough(input, placed), 0) << "no points at all";
  input.hits = &hits;
  EXPECT_EQ(RaysThrough(input, placed), through);
  input.hits = &before;
  EXPECT_EQ(RaysThrough(input, placed), 0) << "they end before it";
  input.hits = &on;
  EXPECT_EQ(RaysThrough(input, placed), 0) << "they end on it";
}

TEST(PerceptionRays, ManyPointsAndNoneOfThemOnTheTargetHitAnotherThing) {
  const FitInput input = Predicted();
  std::vector<TargetPoint> behind, on;
  for (int i = 0; i < 10; ++i) behind.push_back(PointAt({4.0, 0.02 * i, 0.5}));
  for (int i = 0; i < 3; ++i) on.push_back(PointAt({2.85, 0.0, 0.45 + 0.1 * i}));
  const std::vector<TargetPoint> seven(behind.begin(), behind.begin() + 7);
  std::vector<TargetPoint> mixed = on;
  mixed.insert(mixed.end(), seven.begin(), seven.end());
  EXPECT_TRUE(HitElsewhere(input, {behind}));
  EXPECT_FALSE(HitElsewhere(input, {on, seven}));
  EXPECT_FALSE(HitElsewhere(input, {mixed}));
  behind.pop_back();
  EXPECT_FALSE(HitElsewhere(input, {behind}));
}

TEST(PerceptionPieces, WhatGoesWithTheWidthIsThePiecesOwn) {
  cv::Mat bgr(240, 376, CV_8UC3, cv::Scalar::all(120));
  bgr(cv::Rect(100, 60, 80, 90)).setTo(cv::Scalar(12, 105, 235));
  DetectorConfig config;
  config.shape.inset = 0.1;
  config.shape.outline_sigma = 0.05;
  const auto whole = ColorDetector(config, 0.5).Detect(bgr).front();
  ASSERT_EQ(whole.box.width, 80.0);
  EXPECT_DOUBLE_EQ(whole.inset_px, 8.0);
  const auto left = CropTo(bgr, whole, {100, 0, 20, 240});
  const auto right = CropTo(bgr, whole, {150, 0, 30, 240});
  ASSERT_TRUE(left && right);
  EXPECT_DOUBLE_EQ(left->inset_px, 2.0);
  EXPECT_DOUBLE_EQ(left->silhouette.departure_px, 1.0);
  EXPECT_NEAR(std::pow(whole.silhouette.sigma_px, 2) - std::pow(left->silhouette.sigma_px, 2),
              4.0 * 4.0 - 1.0 * 1.0, 1e-9);
}

/// Something grey hides the left half of the target.
TEST(PerceptionCandidate, WithoutPointsAWayAlongTheLineOfSightIsNotSure) {
  const auto gone = [](const Vector3d& way) {
    Candidate c;
    c.track.state.mean << kTarget, Vector3d::Zero();
    c.track.state.covariance = 1e-4 * Matrix6d::Identity();
    c.odds = c.last.fit.log_odds = 20.0;
    c.last.detection.silhouette.sigma_px = 0.5;
    c.last.detection.box.height = 40.0;
    c.first = c.Now();
    c.track.state.mean << kTarget + way, way;
    c.track.t = 1.0;
    c.edge = 0.5 * 3.0 / 220.0;
    return c;
  };
  Candidate along = gone({0.4, 0.0, 0.0}), across = gone({0.0, 0.4, 0.0});
  ASSERT_TRUE(along.Drives() && along.Steady() && across.Drives() && across.Steady());
  EXPECT_FALSE(along.SurelyDrives(0.15));
  EXPECT_TRUE(across.SurelyDrives(0.15));
  EXPECT_FALSE(across.SurelyDrives(0.5));
  along.first.ranged = true;
  EXPECT_FALSE(along.SurelyDrives(0.15)) << "points of the first time alone";
  along.last.fit.n_points = 20;
  EXPECT_TRUE(along.SurelyDrives(0.15));
}

}  // namespace
}  // namespace chase::perception
