#include <gtest/gtest.h>

#include <cmath>

#include "common/world/random.h"
#include "logs/src/lagged_response.h"
#include "logs/src/regression.h"

namespace chase::logs {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;
using world::Random;

constexpr int kInstants = 2000;

/// Two slow regressors and noise with a memory, of which each twentieth sample is an outlier.
Regression Drawn(const Vector2d& truth, double memory, Random* random) {
  Regression r;
  r.X.resize(kInstants, 2);
  r.y.resize(kInstants);
  r.prior = Vector2d(10.0, 10.0);
  const double p1 = random->Uniform(0.0, 6.0), p2 = random->Uniform(0.0, 6.0);
  double noise = 0.0;
  for (int i = 0; i < kInstants; ++i) {
    noise = memory * noise + std::sqrt(1.0 - memory * memory) * random->Gaussian();
    r.X.row(i) << std::sin(0.05 * i + p1), std::cos(0.031 * i + p2);
    r.y[i] = r.X.row(i) * truth + 0.1 * noise + (random->Uniform() < 0.05 ? 3.0 : 0.0);
  }
  return r;
}

TEST(Regression, CoversTheTruthUnderNoiseWithAMemoryAndOutliers) {
  const Vector2d truth(0.7, -0.3);
  for (const int memory : {0, 20}) {
    int within = 0;
    double squares = 0.0, claimed = 0.0;
    for (uint64_t seed = 1; seed <= 100; ++seed) {
      Random random(seed, 2);
      Regression r = Drawn(truth, 0.9, &random);
      r.memory = memory;
      const Solution s = Solve(r);
      const double error = s.value[0] - truth[0];
      within += std::abs(error) <= 2.0 * std::sqrt(s.covariance(0, 0));
      squares += error * error, claimed += s.covariance(0, 0);
    }
    // 95 % of 100: fewer than 88 come by chance once in 250 times.
    EXPECT_GE(within, 88) << memory;
    EXPECT_LE(claimed, 4.0 * squares) << memory;
    EXPECT_LE(std::sqrt(squares / 100.0), 0.02) << memory;
  }
}

/// A step response every second, through a lag and a delay.
Regression Lagged(const Lags& truth, const Lags& lags, double noise) {
  Random random(3, 3);
  const auto answer = [](const Lags& l, double t) {
    const double since = std::fmod(t, 1.0) - l.delay;
    const double sign = static_cast<int>(t) % 2 == 0 ? 1.0 : -1.0;
    return since < 0.0 ? -sign : sign * (1.0 - 2.0 * std::exp(-since / l.lag));
  };
  Regression r;
  r.X.resize(kInstants, 1);
  r.y.resize(kInstants);
  r.prior = VectorXd::Constant(1, 10.0);
  for (int i = 0; i < kInstants; ++i) {
    r.X(i, 0) = answer(lags, 0.005 * i);
    r.y[i] = 2.0 * answer(truth, 0.005 * i) + noise * random.Gaussian();
  }
  return r;
}

TEST(LaggedResponse, FindsLagAndDelay) {
  const LaggedSolution found = SolveLagged([](const Lags& lags) {
    return Lagged({0.05, 0.033}, lags, 0.05);
  });
  EXPECT_TRUE(found.converged);
  EXPECT_NEAR(found.at.lag, 0.05, 0.003);
  EXPECT_NEAR(found.at.delay, 0.033, 0.003);
  EXPECT_NEAR(found.solution.value[0], 2.0, 0.02);
}

TEST(LaggedResponse, SaysWhereTheLagsLieOutOfRange) {
  for (const Lags& truth : {Lags{0.8, 0.0}, Lags{0.05, 0.45}, Lags{0.05, -0.1}}) {
    const auto model = [&](const Lags& lags) { return Lagged(truth, lags, 0.05); };
    const LaggedSolution found = SolveLagged(model);
    EXPECT_FALSE(found.converged) << truth.lag << " " << truth.delay;
    EXPECT_LE(found.at.lag, 0.3);
    EXPECT_LE(found.at.delay, 0.3);
    EXPECT_EQ(found.solution.value[0], Solve(model(found.at)).value[0]) << "of these lags";
    EXPECT_EQ(found.solution.value[1], found.at.lag);
    EXPECT_EQ(found.solution.value[2], found.at.delay);
  }
}

}  // namespace
}  // namespace chase::logs
