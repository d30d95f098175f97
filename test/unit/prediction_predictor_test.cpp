// What every prediction must keep: clear of obstacles, anchored to the target, never blocked by
// what the target itself put on the map, never out of bounds, the same every time.
#include <gtest/gtest.h>

#include <cmath>

#include "common/math/gaussian.h"
#include "common/world/random.h"
#include "services/prediction/predictor.h"
#include "services/prediction/reference.h"
#include "test/unit/prediction_instances.h"

namespace chase::prediction {
namespace {

using Verdict = PredictResult::Verdict;

PredictRequest Straight(double speed, int count = 8, double length = 1.0) {
  PredictRequest request;
  request.now = 5.0;
  for (int i = 0; i < count; ++i) {
    const double t = -length * (1.0 - static_cast<double>(i + 1) / count);
    request.observations.push_back(
        {5.0 + t, {speed * t, 0.0, 0.5}, 0.0016 * Eigen::Matrix3d::Identity()});
  }
  return request;
}

world::Obstacle Pillar(double x, double y, double radius) {
  world::Obstacle o;
  o.center = world::Trajectory::Constant({x, y, 0.5}, 0.0, 1.0);
  o.shape = Eigen::Vector3d(1 / (radius * radius), 1 / (radius * radius), 0.1).asDiagonal();
  return o;
}

double LeastDistance(const PredictResult& result, const world::Obstacle& obstacle) {
  double least = INFINITY;
  for (int i = 0; i <= 2000; ++i) {
    const double t = result.trajectory.start + result.trajectory.duration * i / 2000.0;
    least = std::min(least, obstacle.SquaredDistance(result.trajectory.Position(t), t));
  }
  return least;
}

TEST(Predictor, FollowsAStraightLine) {
  PredictorConfig config;
  config.motion.steady = false;
  config.damping = 0.0;
  const PredictResult result = Predictor(config).Predict(Straight(0.8));
  EXPECT_EQ(result.verdict, Verdict::kOk);
  EXPECT_EQ(result.candidates, 390625);
  EXPECT_NEAR(result.trajectory.Position(7.5).x(), 2.0, 1e-6);
  EXPECT_NEAR(result.trajectory.Velocity(5.0).x(), 0.8, 1e-6);
  EXPECT_DOUBLE_EQ(result.trajectory.Position(7.5).z(), 0.5);
  // The default one holds turns for possible, which shortens the way a little.
  EXPECT_NEAR(Predictor({}).Predict(Straight(0.8)).trajectory.Position(7.5).x(), 2.0, 0.07);
}

// Its height is held, and how far that may be off is told: little on level ground.
TEST(Predictor, TellsHowTheHeightDepartsFromTheOneThatIsHeld) {
  for (const double slope : {0.0, 0.1, -0.3, 0.5}) {
    PredictRequest request = Straight(1.2);
    const auto height = [&](double t) { return 0.5 + slope * 1.2 * (t - 5.0); };
    for (Observation& o : request.observations) o.mean.z() = height(o.t);
    const PredictResult result = Predictor({}).Predict(request);
    const auto sigma = [&](double ahead) {
      return std::sqrt(result.position_covariance(2, 2) +
                       ahead * ahead * result.velocity_covariance(2, 2));
    };
    for (double t = 5.0; t <= 7.5; t += 0.25)
      EXPECT_LE(std::abs(result.trajectory.Position(t).z() - height(t)), 2.0 * sigma(t - 5.0))
          << slope << " " << t;
    if (slope == 0.0) {
      EXPECT_LT(sigma(1.0), 0.12);
    }
  }
}

// At most 5 % beyond two deviations, whatever the noise, the slope and the number of observations.
TEST(Predictor, TheDeviationsOfTheHeightHold) {
  world::Random random(7, 1);
  for (const int count : {3, 8})
    for (const double slope : {0.0, 0.2}) {
      int beyond = 0, n = 0;
      for (int i = 0; i < 100; ++i) {
        PredictRequest request = Straight(1.2, count, count == 3 ? 0.15 : 1.0);
        const auto height = [&](double t) { return 0.5 + slope * 1.2 * (t - 5.0); };
        for (Observation& o : request.observations)
          o.mean.z() = height(o.t) + 0.04 * random.Gaussian();
        const PredictResult result = Predictor({}).Predict(request);
        for (const double ahead : {0.0, 1.0, 2.5}) {
          const double variance =
              result.position_covariance(2, 2) + ahead * ahead * result.velocity_covariance(2, 2);
          const double off = result.trajectory.Position(5.0 + ahead).z() - height(5.0 + ahead);
          beyond += off * off > 4.0 * variance;
          ++n;
        }
      }
      EXPECT_LE(beyond, 0.05 * n) << count << " " << slope;
    }
}

TEST(Predictor, OkMeansClearOfEveryObstacleAtEveryTime) {
  int ok = 0;
  for (uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    InstanceGenerator generator(seed);
    const PredictRequest request = generator.Make(6, 10);
    const PredictResult result = Predictor({}).Predict(request);
    if (result.verdict != Verdict::kOk) continue;
    ++ok;
    PredictorConfig free;
    free.smallest_shrink = 0.0;
    const CandidateSet candidates(free, request.observations, request.now);
    for (const world::Obstacle& o : request.obstacles) {
      double deepest = o.SquaredDistance(result.trajectory.Position(request.now), request.now);
      for (const Observation& seen : request.observations)
        deepest = std::min(deepest, o.SquaredDistance(seen.mean, seen.t));
      if (deepest < 1.5) continue;  // such are shrunk, on purpose
      EXPECT_GT(LeastDistance(result, o), 1.0 - 1e-9);
    }
  }
  EXPECT_GE(ok, 40);
}

TEST(Predictor, SaysSoWhenEverythingCollidesAndOffersTheLeastBad) {
  PredictRequest request = Straight(2.0);
  world::Obstacle wall = Pillar(0.6, 0.0, 0.3);
  wall.shape(1, 1) = 0.01;
  request.obstacles.push_back(wall);
  PredictorConfig narrow;
  narrow.spread = narrow.sigma_floor;
  narrow.contour_sigmas = 1.0;
  const PredictResult result = Predictor(narrow).Predict(request);
  EXPECT_EQ(result.verdict, Verdict::kColliding);
  EXPECT_FALSE(result.reason.empty());
  EXPECT_LT(result.free_share, 1.0);
  EXPECT_TRUE(result.trajectory.coefficients.allFinite());
  // Clear of the wall shrunk to that share.
  wall.shape /= result.free_share > 0.0 ? result.free_share * result.free_share : 1e-12;
  if (result.free_share > 0.0) {
    EXPECT_GT(LeastDistance(result, wall), 1.0 - 1e-9);
  }
}

TEST(Predictor, IsNotBlockedByAnObstacleThatCoversTheTarget) {
  for (double radius : {0.1, 0.2, 0.4, 0.8}) {
    SCOPED_TRACE(radius);
    PredictRequest request = Straight(0.8);
    request.target_radius = 0.15;
    request.obstacles = {Pillar(0.0, 0.0, radius),     // the target itself, left on the map
                         Pillar(-0.4, 0.05, radius)};  // and where it came from
    EXPECT_EQ(Predictor({}).Predict(request).verdict, Verdict::kOk);
  }
}

TEST(Predictor, ShrinksAnObstacleThatTouchesTheTarget) {
  PredictRequest request = Straight(0.8);
  request.obstacles = {Pillar(0.0, 0.55, 0.6)};
  const PredictResult result = Predictor({}).Predict(request);
  EXPECT_EQ(result.verdict, Verdict::kOk);
  EXPECT_EQ(result.obstacles, 1);  // shrunk, not left out
}

TEST(Predictor, GrowsObstaclesByTheTargetsRadius) {
  PredictRequest request = Straight(0.8);
  request.obstacles = {Pillar(1.2, 0.45, 0.3)};
  request.target_radius = 0.3;
  const PredictResult result = Predictor({}).Predict(request);
  world::Obstacle grown = request.obstacles.front();
  grown.shape = world::Inflated(grown.shape, 0.3);
  ASSERT_EQ(result.verdict, Verdict::kOk);
  EXPECT_GT(LeastDistance(result, grown), 1.0 - 1e-9);
  EXPECT_GT(result.checked, 1);
}

TEST(Predictor, AvoidsMovingObstaclesWhereTheyWillBe) {
  PredictRequest request = Straight(0.8);
  world::Obstacle mover = Pillar(1.6, 2.4, 0.3);  // crosses the path when the target is there
  mover.center = {5.0, 2.5, Eigen::MatrixXd::Zero(2, 3)};
  mover.center.coefficients << 1.6, 2.6, 0.5, 0.0, -3.0, 0.0;
  request.obstacles = {mover};
  const PredictResult result = Predictor({}).Predict(request);
  ASSERT_EQ(result.verdict, Verdict::kOk);
  EXPECT_GT(LeastDistance(result, mover), 1.0 - 1e-9);
}

TEST(Predictor, KeepsToTheSpeedLimit) {
  PredictorConfig config;
  config.max_target_speed = 1.5;
  const PredictResult result = Predictor(config).Predict(Straight(6.0));
  for (double t = 5.0; t <= 7.5; t += 0.1)
    EXPECT_LT(result.trajectory.Velocity(t).norm(), 1.5 * 1.2);
}

TEST(Predictor, DoesNotSwingWhenTheObservationsAreOld) {
  PredictRequest request = Straight(0.8);
  request.now += 1.0;
  const PredictResult result = Predictor({}).Predict(request);
  EXPECT_LT((result.trajectory.Position(6.0) - Eigen::Vector3d(0.8, 0, 0.5)).norm(), 0.15);
  EXPECT_LT((result.trajectory.Position(8.5) - Eigen::Vector3d(2.8, 0, 0.5)).norm(), 0.6);
}

TEST(Predictor, SurvivesDegenerateObservations) {
  const Predictor predictor({});
  EXPECT_EQ(predictor.Predict({}).verdict, Verdict::kNoTarget);
  PredictRequest request = Straight(0.8, 1);
  EXPECT_EQ(predictor.Predict(request).verdict, Verdict::kNoTarget);
  request = Straight(0.8, 2);
  EXPECT_EQ(predictor.Predict(request).verdict, Verdict::kOk);
  for (Observation& o : request.observations) o.t = 5.0;  // all at one time
  EXPECT_TRUE(predictor.Predict(request).trajectory.coefficients.allFinite());
  request = Straight(0.8);
  for (Observation& o : request.observations) o.covariance.setZero();
  EXPECT_EQ(predictor.Predict(request).verdict, Verdict::kOk);
  for (Observation& o : request.observations) o.mean.x() *= 1e6;  // densities beyond e^600
  EXPECT_TRUE(predictor.Predict(request).trajectory.coefficients.allFinite());
  request.observations[2].mean.x() = NAN;
  EXPECT_EQ(predictor.Predict(request).verdict, Verdict::kOk);
  for (Observation& o : request.observations) o.t += 100.0;  // from the future
  EXPECT_EQ(predictor.Predict(request).verdict, Verdict::kNoTarget);
}

TEST(Predictor, SurvivesDegenerateObstacles) {
  PredictRequest request = Straight(0.8);
  request.obstacles.assign(3, Pillar(1.0, 0.0, 0.3));
  request.obstacles[0].shape.setZero();
  request.obstacles[1].shape(0, 0) = NAN;
  request.obstacles[2].center.coefficients(0, 0) = INFINITY;
  EXPECT_EQ(Predictor({}).Predict(request).obstacles, 0);
}

TEST(Predictor, RepeatsBitForBit) {
  InstanceGenerator generator(42);
  const PredictRequest request = generator.Make(8, 10);
  const PredictResult a = Predictor({}).Predict(request), b = Predictor({}).Predict(request);
  EXPECT_TRUE(a.trajectory.coefficients == b.trajectory.coefficients);
  EXPECT_EQ(a.cost, b.cost);
  EXPECT_EQ(a.checked, b.checked);
}

TEST(Predictor, DoesNotDependOnWhereTheWorldBegins) {
  InstanceGenerator generator(3);
  PredictRequest request = generator.Make(6, 10);
  const PredictResult here = Predictor({}).Predict(request);
  const Eigen::Vector3d shift(1000.0, -2000.0, 50.0);
  for (Observation& o : request.observations) o.mean += shift;
  for (world::Obstacle& o : request.obstacles) o.center.coefficients.row(0) += shift;
  const PredictResult there = Predictor({}).Predict(request);
  EXPECT_NEAR(here.cost, there.cost, 1e-6 * (1 + here.cost));
  EXPECT_LT((here.trajectory.Position(request.now + 2) + shift -
             there.trajectory.Position(request.now + 2))
                .norm(),
            1e-6);
}

TEST(Predictor, LargeSetsReportAnHonestGap) {
  for (uint64_t seed = 0; seed < 8; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    InstanceGenerator generator(seed);
    PredictorConfig config;
    config.table_limit = 1;
    config.node_limit = 3;
    const PredictRequest request = generator.Make(7, 6);
    const PredictResult capped = Predictor(config).Predict(request);
    const PredictResult exact = Predictor({}).Predict(request);
    if (capped.verdict != Verdict::kOk || exact.verdict != Verdict::kOk) continue;
    EXPECT_GE(capped.cost, exact.cost * (1 - 1e-9));
    EXPECT_LE(capped.cost * (1 - capped.gap), exact.cost * (1 + 1e-9));
  }
}

TEST(Predictor, BoundedTablesReportAnHonestGap) {
  int stopped = 0;
  for (uint64_t seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    InstanceGenerator generator(seed);
    PredictorConfig config;
    config.visit_limit = 60;
    const PredictRequest request = generator.Make(8, 10);
    const PredictResult capped = Predictor(config).Predict(request);
    const PredictResult exact = Predictor({}).Predict(request);
    EXPECT_EQ(exact.gap, 0.0);
    EXPECT_LE(capped.nodes, 4 * 100);  // each search ends with the row it is in
    if (capped.verdict != Verdict::kOk || exact.verdict != Verdict::kOk) continue;
    stopped += capped.gap > 0.0;
    EXPECT_GE(capped.cost, exact.cost * (1 - 1e-9));
    EXPECT_LE(capped.cost * (1 - capped.gap), exact.cost * (1 + 1e-9));
  }
  EXPECT_GE(stopped, 5);
}

// In-reach culling and the guarded exponential change nothing: against the paper's cost in plain
// densities.
TEST(CandidateSet, RanksAsThePapersCost) {
  InstanceGenerator generator(11);
  const PredictRequest request = generator.Make(4, 0);
  PredictorConfig config;
  config.motion.steady = false;
  config.damping = 0.0;
  config.planar = false;
  config.sigma_floor = 1e-3;
  config.spread = 1e-3;
  const CandidateSet set(config, request.observations, request.now);
  double log_densities_at_means = 0.0;
  for (const Observation& o : request.observations)
    log_densities_at_means += math::LogDensity({o.mean, o.covariance}, o.mean);
  for (int i = 0; i < 625; i += 7) {
    const Choice choice = {i % 5, i / 5 % 5, i / 25 % 5, i / 125};
    const Coefficients q = set.CoefficientsOf(set.Delta(choice));
    const world::Trajectory x{request.now, set.horizon(), q};
    double smoothness = 0.0, inverse_density = 1.0;
    for (int k = 0; k < 4000; ++k)
      smoothness += x.Acceleration(request.now + (k + 0.5) * 2.5 / 4000).squaredNorm() * 2.5 / 4000;
    for (const Observation& o : request.observations)
      inverse_density /= std::exp(math::LogDensity({o.mean, o.covariance}, x.Position(o.t)));
    const double w_q = config.density_weight * std::exp(log_densities_at_means);
    const double paper = smoothness + w_q * inverse_density;
    EXPECT_NEAR(set.Cost(set.Delta(choice)), paper, 1e-5 * (1 + paper));
  }
}

// The closed form against eq. (2): no other coefficients do better.
TEST(CandidateSet, FitMinimisesItsObjective) {
  InstanceGenerator generator(12);
  const PredictRequest request = generator.Make(5, 0);
  PredictorConfig config;
  config.motion.steady = false;
  config.planar = false;
  const CandidateSet set(config, request.observations, request.now);
  const auto objective = [&](const Coefficients& q) {
    const world::Trajectory x{request.now, set.horizon(), q};
    double sum = 0.0;
    for (int k = 0; k < 2000; ++k) {
      const double t = request.now + (k + 0.5) * 2.5 / 2000;
      sum += (x.Acceleration(t).squaredNorm() + config.damping * x.Velocity(t).squaredNorm()) *
             2.5 / 2000;
    }
    for (const Observation& o : request.observations)
      sum += config.fit_weight * (x.Position(o.t) - o.mean).squaredNorm();
    return sum;
  };
  const double best = objective(set.mean_fit());
  for (int i = 0; i < 200; ++i) {
    Coefficients q = set.mean_fit();
    for (Eigen::Index k = 0; k < q.size(); ++k) q.data()[k] += 0.03 * generator.Normal();
    EXPECT_GE(objective(q), best - 1e-6);
  }
}

// The cost of a candidate that deviates from the steady motion, from the trajectories themselves.
TEST(CandidateSet, CountsFromTheSteadyMotion) {
  InstanceGenerator generator(13);
  const PredictRequest request = generator.Make(4, 0);
  PredictorConfig config;
  config.planar = false;
  config.sigma_floor = 1e-3;
  config.spread = 1e-3;
  const CandidateSet set(config, request.observations, request.now);
  const world::Trajectory middle{request.now, set.horizon(), set.mean_fit()};
  EXPECT_NEAR(set.Cost(set.Delta({0, 0, 0, 0})), config.density_weight, 1e-12);
  for (int i = 1; i < 625; i += 13) {
    const Choice choice = {i % 5, i / 5 % 5, i / 25 % 5, i / 125};
    const world::Trajectory x{request.now, set.horizon(), set.CoefficientsOf(set.Delta(choice))};
    double smoothness = 0.0, exponent = 0.0;
    for (int k = 0; k < 4000; ++k) {
      const double t = request.now + (k + 0.5) * 2.5 / 4000;
      smoothness += (x.Acceleration(t) - middle.Acceleration(t)).squaredNorm() * 2.5 / 4000;
    }
    for (const Observation& o : request.observations)
      exponent +=
          0.5 * math::SquaredMahalanobis({middle.Position(o.t), o.covariance}, x.Position(o.t));
    const double expected = smoothness + config.density_weight * std::exp(exponent);
    EXPECT_NEAR(set.Cost(set.Delta(choice)), expected, 1e-5 * (1 + expected));
  }
}

TEST(PredictorConfig, NamesWhatIsWrong) {
  PredictorConfig config;
  EXPECT_EQ(config.Problem(), "");
  config.degree = 12;
  EXPECT_NE(config.Problem().find("degree"), std::string::npos);
  config = {};
  config.motion.turn_memory = 0.0;
  EXPECT_NE(config.Problem().find("motion.turn_memory"), std::string::npos);
  config = {};
  config.horizon = NAN;
  EXPECT_NE(config.Problem().find("horizon"), std::string::npos);
}

}  // namespace
}  // namespace chase::prediction
