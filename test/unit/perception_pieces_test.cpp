// Pieces of one blob, and what LiDAR points tell for or against one of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "perception_world.h"
#include "services/perception/belief/finder.h"
#include "services/perception/place/localiser.h"
#include "services/perception/place/target_points.h"
#include "services/perception/sensors/camera.h"
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

/// A blob whose outline lies at these edges of the box, 7 samples a side; sides that are cut have
/// none.
Detection Outlined(const cv::Rect2d& box, const std::array<bool, 4>& cut) {
  Detection d;
  d.box = box;
  d.cut = d.goes_on = d.parted = cut;
  d.silhouette.sigma_px = 5.0;
  for (int i = 1; i <= 7; ++i) {
    const double u = box.x + i * box.width / 8.0, v = box.y + i * box.height / 8.0;
    const std::array<Eigen::Vector2d, 4> at = {
        {{box.x, v}, {box.br().x, v}, {u, box.y}, {u, box.br().y}}};
    for (size_t side = 0; side < 4; ++side)
      if (!cut[side]) d.silhouette.samples[side].push_back(at[side]);
  }
  return d;
}

TEST(PerceptionPieces, OfWhatIsTheThingAsAWholeAreNotTried) {
  const PerceptionConfig config;
  const Finder finder(config);
  PoseSample pose;
  pose.p_WB = kLidar;
  View view{0.0, pose, CameraAt(pose, config.rig), {}, {}, {}};
  Track track;
  track.state = Predicted().prior;
  const auto box = ProjectTarget(view.camera, kTarget, track.shape);
  ASSERT_TRUE(box);
  // As a cone's: its sides depart from the model's, so that its middle alone fits better.
  const double in = 0.35 * box->width;
  const cv::Rect2d narrow(box->x + in, box->y, box->width - 2.0 * in, box->height);
  const cv::Rect2d middle(box->x + 0.4 * box->width, box->y, 0.2 * box->width, box->height);
  Detection piece = Outlined(middle, {true, true, false, false});
  piece.part = true;
  const auto found = [&](const std::vector<Detection>& detections) {
    view.detections = detections;
    view.taken.assign(detections.size(), false);
    return finder.Find(track, &view);
  };
  const Detection whole = Outlined(narrow, {});
  const auto alone = found({whole}), part = found({piece}), both = found({whole, piece});
  ASSERT_TRUE(alone && part && both);
  ASSERT_TRUE(alone->fit.whole);
  ASSERT_GT(part->fit.log_odds, alone->fit.log_odds) << "by less that is explained";
  EXPECT_FALSE(both->detection.part);
  EXPECT_TRUE(view.taken[1]);
  Detection other =
      Outlined(cv::Rect2d(box->x - 2.0 * box->width, box->y, 4.0 * box->width, box->height), {});
  const auto joined = found({other, piece});
  ASSERT_TRUE(joined);
  EXPECT_TRUE(joined->detection.part) << "the blob is more than the thing";
}

TEST(PerceptionCandidate, OfAPieceWithoutPointsAWayAlongTheLineOfSightIsNotSure) {
  const auto gone = [](const Vector3d& way, int points) {
    Track c;
    c.state.mean << kTarget, Vector3d::Zero();
    c.state.covariance = 1e-4 * Matrix6d::Identity();
    c.odds = c.last.fit.log_odds = 20.0;
    c.last.fit.n_points = points;
    c.last.detection.silhouette.sigma_px = 0.5;
    c.last.detection.box.height = 40.0;
    c.partial = true;
    c.first = c.Now();
    c.state.mean << kTarget + way, way;
    c.t = 1.0;
    return c;
  };
  const Vector3d along(0.4, 0.0, 0.0), across(0.0, 0.4, 0.0);
  EXPECT_FALSE(gone(along, 0).Drives());
  EXPECT_TRUE(gone(across, 0).Drives());
  EXPECT_TRUE(gone(along, 20).Drives());
  Track half = gone(along, 20);
  half.last.fit.n_points = 0;
  EXPECT_FALSE(half.Drives()) << "points of the first time alone";
}

}  // namespace
}  // namespace chase::perception
