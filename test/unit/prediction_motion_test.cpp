// The steady motion against the motions that it is made for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "services/prediction/steady_motion.h"
#include "test/unit/prediction_instances.h"

namespace chase::prediction {
namespace {

constexpr double kHorizon = 2.5;

Eigen::Vector3d OnCircle(double t, double rate, double speed) {
  return {speed / rate * std::sin(rate * t), speed / rate * (1.0 - std::cos(rate * t)), 0.5};
}

// What f says between -3 s and 0, every 0.125 s, with noise.
template <class F>
std::vector<Observation> Seen(F f, double sigma = 0.0, uint64_t seed = 0, double now = 7.0) {
  InstanceGenerator random(seed);
  std::vector<Observation> seen;
  for (int i = 24; i-- > 0;) {
    const double t = -0.125 * i;
    const double x = random.Normal(), y = random.Normal();
    seen.push_back(
        {now + t, f(t) + sigma * Eigen::Vector3d(x, y, 0.0), 0.0006 * Eigen::Matrix3d::Identity()});
  }
  return seen;
}

Eigen::Vector3d Forecast(const std::vector<Observation>& seen, double ahead,
                         const MotionConfig& config = {}, int rows = 4, double now = 7.0) {
  const auto q = SteadyForecast(config, seen, now, kHorizon, rows, 4.0);
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  for (Eigen::Index k = q.rows(); k-- > 0;) x = x * (ahead / kHorizon) + q.row(k).transpose();
  return x;
}

TEST(SteadyMotion, GoesStraightOnWithATargetThatGoesStraight) {
  const auto line = [](double t) { return Eigen::Vector3d(0.9 * t, -0.4 * t, 0.2 * t); };
  const auto seen = Seen(line);
  for (double ahead : {0.0, 0.5, 1.0, 2.5})
    EXPECT_LT((Forecast(seen, ahead) - line(ahead)).norm(), 0.01 + 0.03 * ahead) << ahead;
}

TEST(SteadyMotion, KeepsTurningWithATargetThatTurns) {
  MotionConfig config;
  config.turn_memory = 1000.0;
  for (double rate : {-0.5, -0.25, 0.25, 0.5}) {
    const auto circle = [rate](double t) { return OnCircle(t, rate, 1.0); };
    const double straight = (circle(2.5) - Eigen::Vector3d(2.5, 0, 0.5)).norm();
    EXPECT_LT((Forecast(Seen(circle), 2.5, config) - circle(2.5)).norm(), 0.15 * straight) << rate;
  }
}

TEST(SteadyMotion, ComesToRestWithATargetThatSlowsDown) {
  MotionConfig deaf;
  deaf.slowing_share = deaf.gaining_share = 1e-6;
  for (const double rest : {0.5, 1.0, 2.0}) {  // s until it stands; it slows down since 1 s
    const auto braking = [rest](double t) {
      const double T = rest + 1.0, s = std::clamp(t + 1.0, 0.0, T), v0 = T;  // at 1 m/s^2
      return Eigen::Vector3d(v0 * (t < -1.0 ? t + 1.0 : s) - 0.5 * s * s, 0.0, 0.5);
    };
    const auto seen = Seen(braking);
    const double error = (Forecast(seen, 1.0) - braking(1.0)).norm();
    EXPECT_LT(error, 0.5 * (Forecast(seen, 1.0, deaf) - braking(1.0)).norm()) << rest;
  }
}

TEST(SteadyMotion, ForgetsWhatWasBeforeAChange) {
  const auto corner = [](double t) {
    return t < -1.0 ? Eigen::Vector3d(t + 1.0, 0, 0.5) : Eigen::Vector3d(0, t + 1.0, 0.5);
  };
  EXPECT_LT((Forecast(Seen(corner), 2.5) - corner(2.5)).norm(), 0.15);
  const auto stop = [](double t) { return Eigen::Vector3d(std::min(t + 1.2, 0.0), 0, 0.5); };
  EXPECT_LT((Forecast(Seen(stop), 2.5) - stop(2.5)).norm(), 0.1);
}

// On free ground: never worse than the least-squares line through the last second.
TEST(SteadyMotion, IsNoWorseThanALineWhereTheTargetGoesStraight) {
  double ours = 0.0, line = 0.0;
  for (uint64_t seed = 0; seed < 300; ++seed) {
    const auto seen = Seen([](double t) { return Eigen::Vector3d(t, 0, 0.5); }, 0.025, seed);
    ours += (Forecast(seen, 2.5) - Eigen::Vector3d(2.5, 0, 0.5)).squaredNorm();
    double t = 0, tt = 0;
    Eigen::Vector3d x(0, 0, 0), tx(0, 0, 0);
    for (size_t i = seen.size() - 9; i < seen.size(); ++i) {
      const double s = seen[i].t - 7.0;
      t += s / 9, tt += s * s / 9, x += seen[i].mean / 9, tx += s * seen[i].mean / 9;
    }
    const Eigen::Vector3d slope = (tx - t * x) / (tt - t * t);
    line += (x + (2.5 - t) * slope - Eigen::Vector3d(2.5, 0, 0.5)).squaredNorm();
  }
  EXPECT_LT(ours, line);
}

TEST(SteadyMotion, TurnsWithTheWorld) {
  const auto circle = [](double t) { return OnCircle(t, 0.4, 1.2); };
  const Eigen::Matrix3d R = Eigen::AngleAxisd(1.1, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d away(300, -200, 5);
  auto seen = Seen(circle, 0.03, 5);
  const Eigen::Vector3d here = Forecast(seen, 2.0);
  for (Observation& o : seen) o.mean = R * o.mean + away;
  EXPECT_LT((Forecast(seen, 2.0) - (R * here + away)).norm(), 1e-9);
}

TEST(SteadyMotion, SurvivesFewAndSimultaneousObservations) {
  const auto all = Seen([](double t) { return Eigen::Vector3d(t, 0, 0.5); });
  EXPECT_LT((Forecast({all.back()}, 2.5) - Eigen::Vector3d(0, 0, 0.5)).norm(), 1e-9);
  EXPECT_TRUE(Forecast({all[22], all[23]}, 2.5).allFinite());
  auto simultaneous = all;
  for (Observation& o : simultaneous) o.t = 7.0;
  EXPECT_TRUE(Forecast(simultaneous, 2.5).allFinite());
  for (int rows = 2; rows <= 8; ++rows)
    EXPECT_LT((Forecast(all, 2.5, {}, rows) - Eigen::Vector3d(2.5, 0, 0.5)).norm(), 0.12);
}

}  // namespace
}  // namespace chase::prediction
