#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "perception_world.h"
#include "services/perception/belief/track.h"
#include "services/perception/place/localiser.h"

namespace chase::perception {
namespace {

using Eigen::Vector3d;
constexpr double kRadius = 0.15, kHeight = 0.5;

PoseSample BodyAt(const Vector3d& p, double yaw, double pitch, double roll) {
  PoseSample pose;
  pose.p_WB = p;
  pose.R_WB = Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) *
              Eigen::AngleAxisd(pitch, Vector3d::UnitY()) *
              Eigen::AngleAxisd(roll, Vector3d::UnitX());
  return pose;
}

/// Outline of the target by dense projection of its surface: for each pixel row the leftmost and
/// rightmost point, for each column the highest and lowest.
Detection DenseOutline(const Camera& camera, const Vector3d& p_WT) {
  std::vector<Eigen::Vector2d> cloud;
  for (int i = 0; i < 1440; ++i)
    for (int k = 0; k <= 240; ++k) {
      const double a = 2.0 * M_PI * i / 1440, z = kHeight * (k / 240.0 - 0.5);
      cloud.push_back(
          *camera.Project(p_WT + Vector3d(kRadius * std::cos(a), kRadius * std::sin(a), z)));
    }
  double u0 = 1e9, u1 = -1e9, v0 = 1e9, v1 = -1e9;
  for (const auto& c : cloud) {
    u0 = std::min(u0, c.x()), u1 = std::max(u1, c.x());
    v0 = std::min(v0, c.y()), v1 = std::max(v1, c.y());
  }
  Detection d;
  d.box = cv::Rect2d(u0, v0, u1 - u0, v1 - v0);
  d.score = 1.0;
  d.silhouette.sigma_px = 0.45;
  const auto extreme = [&](int axis, double at, double sign) {
    double best = -1e9;
    for (const auto& c : cloud)
      if (std::abs(c[1 - axis] - at) < 0.25) best = std::max(best, sign * c[axis]);
    return sign * best;
  };
  for (double share : {0.35, 0.5, 0.65, 0.8}) {
    const double v = v0 + share * (v1 - v0);
    d.silhouette.samples[kLeft].emplace_back(extreme(0, v, -1.0), v);
    d.silhouette.samples[kRight].emplace_back(extreme(0, v, 1.0), v);
  }
  for (double share : {0.4, 0.5, 0.6}) {
    const double u = u0 + share * (u1 - u0);
    d.silhouette.samples[kTop].emplace_back(u, extreme(1, u, -1.0));
    d.silhouette.samples[kBottom].emplace_back(u, extreme(1, u, 1.0));
  }
  return d;
}

TargetGaussian Prior(const Vector3d& p, double sigma) {
  TargetGaussian g;
  g.mean << p, Vector3d::Zero();
  g.covariance.diagonal() << Vector3d::Constant(sigma * sigma), Vector3d::Constant(0.25);
  return g;
}

FitInput InputFor(const PoseSample& pose, const Vector3d& guess, double sigma) {
  FitInput input;
  input.prior = Prior(guess, sigma);
  input.shape.size = {kRadius, kHeight};
  input.camera = CameraAt(pose, {});
  return input;
}

/// Points on the side that faces the lidar at p_WL, at two heights.
std::vector<TargetPoint> SidePoints(const Vector3d& p_WT, const Vector3d& p_WL, double noise,
                                    std::mt19937* random) {
  std::normal_distribution<double> normal;
  const double toward = std::atan2(p_WL.y() - p_WT.y(), p_WL.x() - p_WT.x());
  std::vector<TargetPoint> points;
  for (int i = -8; i <= 8; ++i)
    for (double z : {-0.05, 0.1}) {
      const double a = toward + 0.12 * i, r = kRadius + noise * normal(*random);
      const Vector3d p = p_WT + Vector3d(r * std::cos(a), r * std::sin(a), z);
      points.push_back({p, p_WL, 0.0, (p - p_WL).norm()});
    }
  return points;
}

TEST(PerceptionFit, OutlineAloneGivesThePositionFromDisturbedStarts) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  for (int trial = 0; trial < 12; ++trial) {
    const Vector3d target(3.0 + u(random), u(random), 0.55);
    const auto pose =
        BodyAt({0, 0, 1.2 + 0.6 * u(random)}, 0.2 * u(random), 0.15 * u(random), 0.15 * u(random));
    const Vector3d guess = target + 0.3 * Vector3d(u(random), u(random), u(random));
    auto input = InputFor(pose, guess, 2.0);
    const auto outline = DenseOutline(input.camera, target);
    input.detection = &outline;
    const auto fit = FitTarget(input, {});
    ASSERT_TRUE(fit.ok);
    EXPECT_LT((fit.posterior.position() - target).norm(), 0.03)
        << "trial " << trial << ": " << (fit.posterior.position() - target).transpose();
    for (double r : fit.edge_px) EXPECT_LT(std::abs(r), 0.3);
  }
}

TEST(PerceptionFit, PointsSharpenTheRange) {
  std::mt19937 random(5);
  const Vector3d target(5.0, 0.3, 0.55);
  const auto pose = BodyAt({0, 0, 1.3}, 0, 0, 0);
  auto input = InputFor(pose, target + Vector3d(0.4, 0.1, -0.1), 2.0);
  const auto outline = DenseOutline(input.camera, target);
  input.detection = &outline;
  const auto without = FitTarget(input, {});
  input.points = SidePoints(target, {0, 0, 1.4}, 0.02, &random);
  const auto with = FitTarget(input, {});
  ASSERT_TRUE(without.ok && with.ok);
  EXPECT_LT(with.posterior.covariance(0, 0), 0.2 * without.posterior.covariance(0, 0));
  EXPECT_LT((with.posterior.position() - target).norm(), 0.03);
}

TEST(PerceptionFit, OldPointsAreCarriedOnByTheVelocity) {
  std::mt19937 random(5);
  const Vector3d target(3.0, 0.0, 0.55), velocity(0.0, 1.0, 0.0);
  auto input = InputFor(BodyAt({0, 0, 1.3}, 0, 0, 0), target, 0.05);
  input.prior.mean.tail<3>() = velocity;
  input.prior.covariance.diagonal().tail<3>().setConstant(1e-4);
  input.points = SidePoints(target - 0.15 * velocity, {0, 0, 1.4}, 0.005, &random);
  for (auto& p : input.points) p.age = 0.15;
  const auto fit = FitTarget(input, {});
  ASSERT_TRUE(fit.ok);
  EXPECT_LT((fit.posterior.position() - target).norm(), 0.02);
}

TEST(PerceptionFit, FitWithoutMeasurementsIsThePrior) {
  const auto input = InputFor(BodyAt({0, 0, 1.2}, 0, 0, 0), {3, 0, 0.5}, 0.3);
  const auto fit = FitTarget(input, {});
  ASSERT_TRUE(fit.ok);
  EXPECT_LT((fit.posterior.mean - input.prior.mean).norm(), 1e-9);
  EXPECT_LT((fit.posterior.covariance - input.prior.covariance).norm(), 1e-6);
}

TEST(PerceptionFit, SingularPriorIsRefused) {
  auto input = InputFor(BodyAt({0, 0, 1.2}, 0, 0, 0), {3, 0, 0.5}, 0.3);
  input.prior.covariance.setZero();
  EXPECT_FALSE(FitTarget(input, {}).ok);
  input.prior.covariance.setConstant(std::nan(""));
  EXPECT_FALSE(FitTarget(input, {}).ok);
}

/// What hides one half of the target must not pull it nor push it away.
TEST(PerceptionLocaliser, HiddenHalfDoesNotBendTheEstimate) {
  PerceptionConfig config;
  const Localiser localiser(config);
  const Vector3d target(3.0, 0.2, 0.55);
  for (int side = 0; side < 4; ++side) {
    auto input = InputFor(BodyAt({0, 0, 1.2}, 0, 0, 0), target + Vector3d(0.02, 0.01, 0.0), 0.06);
    auto outline = DenseOutline(input.camera, target);
    const double by = 0.5 * (side < 2 ? outline.box.width : outline.box.height);
    (side < 2 ? outline.box.width : outline.box.height) -= by;
    if (side == kLeft) outline.box.x += by;
    if (side == kTop) outline.box.y += by;
    for (auto& s : outline.silhouette.samples[static_cast<size_t>(side)])
      s[side < 2 ? 0 : 1] += side == kLeft || side == kTop ? by : -by;
    input.detection = &outline;
    const auto fit = localiser.Correct(input, {});
    ASSERT_TRUE(fit) << "side " << side;
    EXPECT_FALSE(fit->used[static_cast<size_t>(side)]);
    EXPECT_LT((fit->posterior.position() - target).norm(), 0.06) << "side " << side;
  }
}

TEST(PerceptionLocaliser, WhatComesBackIsRatherHalfHidden) {
  const Localiser localiser(PerceptionConfig{});
  const Vector3d target(3.0, 0.2, 0.55);
  auto input = InputFor(BodyAt({0, 0, 1.2}, 0, 0, 0), target + Vector3d(0.02, 0.01, 0.0), 0.1);
  auto outline = DenseOutline(input.camera, target);
  input.detection = &outline;
  const auto whole = localiser.Correct(input, {});
  input.reappears = true;
  const auto whole_again = localiser.Correct(input, {});
  ASSERT_TRUE(whole && whole_again);
  EXPECT_EQ(whole->log_odds, whole_again->log_odds) << "nothing of it is hidden";
  outline.box.width *= 0.5;
  for (auto& s : outline.silhouette.samples[kRight]) s.x() -= outline.box.width;
  const auto half_again = localiser.Correct(input, {});
  input.reappears = false;
  const auto half = localiser.Correct(input, {});
  ASSERT_TRUE(half && half_again);
  EXPECT_LT(half->log_odds, whole->log_odds);
  EXPECT_GT(half_again->log_odds, half->log_odds + 1.0);
}

TEST(PerceptionLocaliser, ALikeColourBeyondAWindowCostsUnlessAnEndOfTheBlobPartsIt) {
  const Localiser localiser(PerceptionConfig{});
  const Vector3d target(3.0, 0.2, 0.55);
  auto input = InputFor(BodyAt({0, 0, 1.2}, 0, 0, 0), target + Vector3d(0.02, 0.01, 0.0), 0.06);
  auto outline = DenseOutline(input.camera, target);
  outline.silhouette.samples[kTop].clear();
  outline.cut[kTop] = outline.goes_on[kTop] = true;
  input.detection = &outline;
  const auto odds = [&] { return localiser.Correct(input, {})->log_odds; };
  ASSERT_TRUE(localiser.Correct(input, {}));
  EXPECT_TRUE(localiser.Correct(input, {})->joined);
  const double beyond_window = odds();
  outline.parted[kTop] = true;
  EXPECT_GT(odds(), beyond_window + 1.0);
}

TEST(PerceptionLocaliser, NearestSurfaceInTheBoxIsTakenNotTheWallBehind) {
  std::mt19937 random(2);
  const PerceptionConfig config;
  const Localiser localiser(config);
  const Vector3d target(3.0, 0.0, 0.55), lidar(0, 0, 1.3);
  auto input = InputFor(BodyAt({0, 0, 1.2}, 0, 0, 0), target + Vector3d(0.1, 0, 0), 0.15);
  const auto outline = DenseOutline(input.camera, target);
  input.detection = &outline;
  std::vector<TargetPoint> wall;
  for (int i = 0; i < 10; ++i) wall.push_back({{6.0, 0.02 * i, 0.4}, lidar, 0.0, 6.0});
  const auto on = SidePoints(target, lidar, 0.02, &random);
  const auto fit = localiser.Correct(input, {on, wall});
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->n_points, static_cast<int>(on.size()));
  EXPECT_LT((fit->posterior.position() - target).norm(), 0.04);
}

TEST(PerceptionLocaliser, ADetectionThatTheLidarSeesThroughIsRefused) {
  const PerceptionConfig config;
  const Localiser localiser(config);
  const Vector3d target(3.0, 0.0, 0.55), lidar(0, 0, 0.55);
  auto input = InputFor(BodyAt({0, 0, 1.2}, 0, 0, 0), target, 0.05);
  const auto outline = DenseOutline(input.camera, target);
  input.detection = &outline;
  std::vector<TargetPoint> wall;
  for (int i = -4; i <= 4; ++i) wall.push_back({{6.0, 0.02 * i, 0.55}, lidar, 0.0, 6.0});
  EXPECT_FALSE(localiser.Correct(input, {wall}));
  EXPECT_FALSE(localiser.Acquire(input.shape, input.camera, outline, {wall}));
  EXPECT_TRUE(localiser.Correct(input, {}));
}

TEST(PerceptionLocaliser, ALookAlikeOfTheWrongSizeIsRefusedByItsRange) {
  const PerceptionConfig config;
  const Localiser localiser(config);
  const auto input = InputFor(BodyAt({0, 0, 1.2}, 0, 0, 0), {3, 0, 0.55}, 1.0);
  // Twice the size at twice the range: the same outline; the points say 6 m.
  const auto outline = DenseOutline(input.camera, {3.0, 0.0, 0.55});
  std::vector<TargetPoint> points;
  for (int i = -6; i <= 6; ++i) points.push_back({{5.7, 0.03 * i, 0.0}, {0, 0, 1.3}, 0.0, 5.85});
  EXPECT_TRUE(localiser.Acquire(input.shape, input.camera, outline, {}));
  EXPECT_FALSE(localiser.Acquire(input.shape, input.camera, outline, {points}));
}

TEST(PerceptionTrack, CovarianceGrowsAsTheModelSays) {
  Track track;
  track.state = Prior({1, 2, 3}, 0.1);
  track.state.mean.tail<3>() = Vector3d(1, 0, 0);
  MotionConfig config;
  Track fine = track;
  track.Predict(0.5, config);
  for (int i = 1; i <= 50; ++i) fine.Predict(0.01 * i, config);
  EXPECT_NEAR(track.state.mean[0], 1.5, 1e-12);
  EXPECT_LT((track.state.covariance - fine.state.covariance).norm(), 1e-9);
  const auto before = track.state.mean;
  track.Predict(0.2, config);
  EXPECT_EQ(track.state.mean, before) << "backwards";
}

TEST(PerceptionTrack, PoseErrorReachesTheTargetThroughTheLeverArm) {
  Track track;
  track.state = Prior({4, 0, 0}, 1e-3);
  PoseSample pose;
  pose.covariance(5, 5) = 0.01;  // heading, rad^2
  MotionConfig config;
  config.pose_sigma = config.tilt_sigma_deg = config.heading_sigma_deg = 0.0;
  const auto P = PublishedCovariance(track, pose, 0.0, config);
  EXPECT_NEAR(P(1, 1), 16.0 * 0.01, 1e-3);
  EXPECT_LT(P(0, 0), 1e-3);
}

TEST(PerceptionPoses, HistoryIsExactForASteadyTurn) {
  PoseHistory history;
  const auto at = [](double t) {
    PoseSample s;
    s.t = t;
    s.p_WB = Vector3d(2.0 * t, 0.0, 1.0);
    s.v_WB = Vector3d(2.0, 0.0, 0.0);
    s.R_WB = Eigen::AngleAxisd(0.8 * t, Vector3d::UnitZ());
    s.w_WB_B = Vector3d(0.0, 0.0, 0.8);
    return s;
  };
  EXPECT_FALSE(history.At(0.0, 1.0));
  for (int i = 0; i <= 100; ++i) history.Add(at(0.005 * i));
  for (const double t : {0.1234, 0.4999, 0.5, 0.54}) {
    const auto s = history.At(t, 0.05);
    ASSERT_TRUE(s) << t;
    EXPECT_LT((s->p_WB - at(t).p_WB).norm(), 1e-9);
    EXPECT_LT(s->R_WB.angularDistance(at(t).R_WB), 1e-9);
  }
  EXPECT_FALSE(history.At(0.56, 0.05));
  EXPECT_FALSE(history.At(-1.0, 0.05));
  EXPECT_TRUE(history.Nearest(0.6, 0.2));
  EXPECT_FALSE(history.Nearest(0.8, 0.2));
}

TEST(PerceptionConfig, ProblemNamesTheField) {
  PerceptionConfig config;
  EXPECT_EQ(config.Problem(), "");
  EXPECT_EQ(config.detector.Problem(), "");
  config.target_radius = -1.0;
  EXPECT_NE(config.Problem().find("target_radius"), std::string::npos);
  config.detector.kind = "magic";
  EXPECT_NE(config.detector.Problem().find("magic"), std::string::npos);
}

}  // namespace
}  // namespace chase::perception
