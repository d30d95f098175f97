// The observation window and the triggers, as pure state machines.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "services/prediction/observation_window.h"
#include "services/prediction/replan_trigger.h"
#include "test/unit/prediction_instances.h"

namespace chase::prediction {
namespace {

using Outcome = ObservationWindow::Outcome;

Observation At(double t, const Eigen::Vector3d& mean, double sigma = 0.04) {
  return {t, mean, sigma * sigma * Eigen::Matrix3d::Identity()};
}
Eigen::Vector3d Walk(double t) { return {0.8 * t, 0.3 * t * t, 0.5}; }

WindowConfig Short() {
  WindowConfig config;
  config.observations = 8;
  config.length = 1.0;
  return config;
}

ObservationWindow Filled(double until, double period = 0.05) {
  ObservationWindow window{Short()};
  for (int i = 0; i * period <= until + 1e-9; ++i) window.Add(At(i * period, Walk(i * period)));
  return window;
}

void ExpectOrdered(const std::vector<Observation>& observations) {
  for (size_t i = 1; i < observations.size(); ++i)
    EXPECT_GT(observations[i].t, observations[i - 1].t);
}

TEST(ObservationWindow, MergesTheWindowIntoAtMostTheAskedNumber) {
  const auto merged = Filled(3.0).Merged();
  EXPECT_EQ(merged.size(), 8u);
  ExpectOrdered(merged);
  EXPECT_GE(merged.front().t, 2.0);
  for (const Observation& o : merged) {
    EXPECT_LT((o.mean - Walk(o.t)).norm(), 0.01);      // the merged mean lies on the path
    EXPECT_LT(o.covariance(0, 0), 0.04 * 0.04 * 0.7);  // and is better known than one observation
  }
}

TEST(ObservationWindow, MergingWeighsByInformation) {
  WindowConfig config = Short();
  config.observations = 2;
  ObservationWindow window(config);
  window.Add(At(0.0, {0, 0, 0}, 0.1));
  window.Add(At(0.7, {1, 0, 0}, 0.1));
  window.Add(At(0.9, {2, 0, 0}, 0.2));
  const auto merged = window.Merged();
  ASSERT_EQ(merged.size(), 2u);
  EXPECT_NEAR(merged[1].mean.x(), (1.0 * 4 + 2.0 * 1) / 5, 1e-12);
  EXPECT_NEAR(merged[1].t, (0.7 * 4 + 0.9 * 1) / 5, 1e-12);
  EXPECT_NEAR(merged[1].covariance(1, 1), 1.0 / (100 + 25), 1e-12);
}

TEST(ObservationWindow, SurvivesGaps) {
  ObservationWindow window = Filled(1.0);
  for (double t = 1.5; t <= 1.8; t += 0.05) EXPECT_EQ(window.Add(At(t, Walk(t))), Outcome::kTaken);
  ExpectOrdered(window.Merged());
  EXPECT_EQ(window.Add(At(9.0, Walk(9.0))), Outcome::kTaken);  // nothing left to compare with
  EXPECT_EQ(window.size(), 1);
}

TEST(ObservationWindow, RefusesDuplicatesAndWhatIsNotFinite) {
  ObservationWindow window = Filled(1.0);
  const int size = window.size();
  EXPECT_EQ(window.Add(At(0.95, Walk(0.95))), Outcome::kDuplicate);
  EXPECT_EQ(window.Add(At(1.05, {NAN, 0, 0})), Outcome::kInvalid);
  EXPECT_EQ(window.Add(At(std::numeric_limits<double>::infinity(), {0, 0, 0})), Outcome::kInvalid);
  EXPECT_EQ(window.size(), size);
}

TEST(ObservationWindow, SortsStampsThatArriveOutOfOrder) {
  ObservationWindow window{WindowConfig{}};
  for (double t : {0.0, 0.1, 0.05, 0.2, 0.15, 0.3, 0.25}) window.Add(At(t, Walk(t)));
  EXPECT_EQ(window.size(), 7);
  EXPECT_DOUBLE_EQ(window.newest(), 0.3);
  ExpectOrdered(window.Merged());
  window = Filled(3.0);
  EXPECT_EQ(window.Add(At(1.5, Walk(1.5))), Outcome::kTooOld);
}

TEST(ObservationWindow, DropsSingleOutliersOnly) {
  ObservationWindow window = Filled(2.0);
  EXPECT_EQ(window.Add(At(2.05, Walk(2.05) + Eigen::Vector3d(1.5, 0, 0))), Outcome::kOutlier);
  EXPECT_EQ(window.Add(At(2.1, Walk(2.1))), Outcome::kTaken);
  for (const Observation& o : window.Merged()) EXPECT_LT((o.mean - Walk(o.t)).norm(), 0.01);
}

TEST(ObservationWindow, RecoversWhenTheTargetReallyJumped) {
  ObservationWindow window = Filled(2.0);
  const Eigen::Vector3d jump(2.0, 1.0, 0.0);
  Outcome last = Outcome::kTaken;
  for (int i = 1; i <= 5; ++i) last = window.Add(At(2.0 + 0.05 * i, Walk(2.0) + jump));
  EXPECT_EQ(last, Outcome::kRestarted);
  EXPECT_EQ(window.size(), 5);
  for (const Observation& o : window.Merged()) EXPECT_LT((o.mean - Walk(2.0) - jump).norm(), 1e-9);
}

TEST(ObservationWindow, TakesTurnsAndStopsForWhatTheyAre) {
  // 1 m/s round a corner of radius 0.8 m after a straight, then a stop at 1.5 m/s^2, with noise.
  InstanceGenerator noise(7);
  ObservationWindow window{WindowConfig{}};
  double x = 0, y = 0, heading = 0, speed = 1.0;
  for (int i = 0; i < 120; ++i) {
    const double t = 0.05 * i;
    if (t > 2 && t < 2 + 0.8 * M_PI / 2) heading += 0.05 * speed / 0.8;
    if (t > 4) speed = std::max(0.0, speed - 0.05 * 1.5);
    x += 0.05 * speed * std::cos(heading), y += 0.05 * speed * std::sin(heading);
    const Eigen::Vector3d seen(x + 0.04 * noise.Normal(), y + 0.04 * noise.Normal(), 0.5);
    EXPECT_EQ(window.Add(At(t, seen)), Outcome::kTaken) << "at " << t;
  }
}

PredictResult Running(double start) {
  PredictResult result;
  result.verdict = PredictResult::Verdict::kOk;
  result.trajectory = {start, 2.5, Eigen::MatrixXd::Zero(2, 3)};
  result.trajectory.coefficients.row(1) << 2.5, 0, 0;  // 1 m/s along x
  result.position_covariance = 1e-4 * Eigen::Matrix3d::Identity();
  result.velocity_covariance = 1e-4 * Eigen::Matrix3d::Identity();
  return result;
}

struct TriggerTest : ::testing::Test {
  std::optional<Cause> Check(double now, const Eigen::Vector3d& seen) {
    request.now = now;
    const math::Gaussian3 observed{seen, 1e-4 * Eigen::Matrix3d::Identity()};
    return trigger.Check(predictor, {now, observed, &request});
  }
  void AddObstacle(const Eigen::Vector3d& center) {
    world::Obstacle o;
    o.center = world::Trajectory::Constant(center, 0, 1);
    o.shape = 9.0 * Eigen::Matrix3d::Identity();
    request.obstacles.push_back(o);
    request.observations = {At(9.0, {-1, 0, 0}), At(10.0, {0, 0, 0})};
  }
  PredictorConfig predictor;
  PredictRequest request;
  ReplanTrigger trigger{TriggerConfig{}};
};

TEST_F(TriggerTest, FirstThenQuietThenExpiry) {
  EXPECT_EQ(Check(10.0, {0, 0, 0}), Cause::kFirst);
  trigger.Started(Running(10.0));
  EXPECT_EQ(Check(10.1, {0.1, 0, 0}), std::nullopt);
  EXPECT_EQ(Check(10.2, {0.2, 0, 0}), Cause::kExpiry);
  EXPECT_EQ(Check(9.0, {0, 0, 0}), Cause::kExpiry);  // the clock was set back
}

TEST_F(TriggerTest, DeviationBeyondTheThresholdAndTheNoise) {
  trigger.Started(Running(10.0));
  EXPECT_EQ(Check(10.1, {0.1, 0.14, 0}), std::nullopt);
  EXPECT_EQ(Check(10.1, {0.1, 0.2, 0}), Cause::kDeviation);
  const math::Gaussian3 vague{{0.1, 0.2, 0}, Eigen::Matrix3d::Identity()};
  EXPECT_EQ(trigger.Check(predictor, {10.1, vague, &request}), std::nullopt);
  EXPECT_EQ(Check(10.01, {5, 5, 0}), std::nullopt);  // the least period
}

TEST_F(TriggerTest, ObstacleThatEntersThePrediction) {
  trigger.Started(Running(10.0));
  AddObstacle({1.5, 3.0, 0});
  EXPECT_EQ(Check(10.1, {0.1, 0, 0}), std::nullopt);
  AddObstacle({1.5, 0.1, 0});
  EXPECT_EQ(Check(10.1, {0.1, 0, 0}), Cause::kObstacle);
  PredictResult colliding = Running(10.0);
  colliding.verdict = PredictResult::Verdict::kColliding;
  trigger.Started(colliding);
  EXPECT_EQ(Check(10.1, {0.1, 0, 0}), std::nullopt);
}

TEST_F(TriggerTest, ReacquiredAfterLoss) {
  trigger.Lost();
  EXPECT_EQ(Check(10.0, {0, 0, 0}), Cause::kFirst);
  trigger.Started(Running(10.0));
  trigger.Lost();
  EXPECT_EQ(Check(10.05, {0, 0, 0}), Cause::kReacquired);
}

}  // namespace
}  // namespace chase::prediction
