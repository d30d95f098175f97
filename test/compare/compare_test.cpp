#include <gtest/gtest.h>

#include <cmath>
#include <type_traits>

#include "test/compare/score.h"

namespace chase::compare {
namespace {

using Eigen::Vector3d;

/// One pillar of 0.5 m at the origin, a target that runs along y = 3 at 1 m/s.
Mission OnePillar() {
  Mission m;
  m.name = "one";
  m.duration = 8.0;
  world::Obstacle o;
  o.center = world::Trajectory::Constant({0, 0, 1}, 0, 8);
  o.shape = Vector3d(4.0, 4.0, 1.0 / 36.0).asDiagonal();
  m.obstacles = {o};
  std::vector<Vector3d> samples;
  for (int i = 0; i <= 130; ++i) samples.emplace_back(0.1 * i, -4.0 + 0.1 * i, 3.0);
  m.path = world::PathMotion(samples);
  return m;
}

/// Flies one polynomial whatever it is asked.
class Stubborn : public planning::Planner {
 public:
  explicit Stubborn(world::Trajectory plan) : plan_(std::move(plan)) {}
  planning::PlanResult Plan(const planning::PlanRequest&) override {
    planning::PlanResult result;
    result.verdict = planning::Verdict::kBrake;
    result.reason = "stubborn";
    result.trajectory = plan_;
    return result;
  }
  bool IsCertified(const planning::PlanRequest&, const world::Trajectory&) override {
    return false;
  }

 private:
  world::Trajectory plan_;
};

world::Trajectory Line(const Vector3d& from, const Vector3d& v, const Vector3d& a, double T) {
  world::Trajectory t{0.0, T, Eigen::MatrixXd::Zero(3, 3)};
  t.coefficients.row(0) = from.transpose();
  t.coefficients.row(1) = T * v.transpose();
  t.coefficients.row(2) = 0.5 * T * T * a.transpose();
  return t;
}

TEST(Score, ThroughThePillarIsUnsafeForAsLongAsItTakes) {
  const Mission mission = OnePillar();  // grown radius 0.8 m
  Stubborn planner(Line({-4, 0, 1}, {1, 0, 0}, {0, 0, 0}, 8.0));
  const Score score = Judge(mission, Fly(mission, &planner));
  EXPECT_NEAR(score.safe_ratio, 1.0 - 1.6 / 8.0, 0.003);
  EXPECT_NEAR(score.min_clearance_m, -0.8, 1e-9);
  EXPECT_FALSE(score.proved_safe);
  EXPECT_NEAR(score.distance_ratio, 1.0, 1e-6);  // abreast of the target at 3 m
  EXPECT_NEAR(score.travel_ratio, 1.0, 2e-3);    // a sampled path begins at rest
  EXPECT_NEAR(score.acceleration_cost, 0.0, 1e-12);
  ASSERT_EQ(score.lapses.size(), 2u);
  EXPECT_EQ(score.lapses[0].what, "touches");
  EXPECT_NEAR(score.lapses[0].from, 3.2, 0.011);
  EXPECT_NEAR(score.lapses[0].to, 4.8, 0.011);
  EXPECT_EQ(score.lapses[0].plan, "BRAKE: stubborn");
  EXPECT_EQ(score.fallbacks, score.replans);
  EXPECT_EQ(score.replans, 40);  // the default period is 0.2 s
}

TEST(Score, BehindThePillarTheTargetIsHiddenButTheFlightIsSafe) {
  const Mission mission = OnePillar();
  Stubborn planner(Line({-4, -3, 1}, {1, 0, 0}, {0, 0, 0}, 8.0));
  const Score score = Judge(mission, Fly(mission, &planner));
  EXPECT_EQ(score.safe_ratio, 1.0);
  EXPECT_TRUE(score.proved_safe);
  EXPECT_NEAR(score.visible_ratio, 1.0 - 1.6 / 8.0, 0.003);  // the line of sight sweeps at 1 m/s
  EXPECT_NEAR(score.visible_ratio_physical, 1.0 - 1.0 / 8.0, 0.003);
  EXPECT_NEAR(score.distance_ratio, 2.0, 1e-6);
  EXPECT_NEAR(score.distance_error, 1.0, 1e-6);
}

TEST(Score, CostsComeFromTheFlownPolynomial) {
  const Mission mission = OnePillar();
  Stubborn planner(Line({-4, 9, 1}, {1, 0, 0}, {0.2, -0.1, 0.05}, 8.0));
  const Score score = Judge(mission, Fly(mission, &planner));
  EXPECT_NEAR(score.acceleration_cost, 0.0525, 1e-9);
  EXPECT_NEAR(score.jerk_cost, 0.0, 1e-12);
  EXPECT_NEAR(score.peak_speed, Vector3d(2.6, -0.8, 0.4).norm(), 1e-9);
}

TEST(Score, AnEndedPlanLeavesTheDroneWhereItIs) {
  const Mission mission = OnePillar();
  Stubborn planner(Line({-4, 6, 1}, {1, 0, 0}, {0, 0, 0}, 2.0));
  const Rollout rollout = Fly(mission, &planner);
  EXPECT_LT((rollout.samples.back().chaser.p - Vector3d(-2, 6, 1)).norm(), 1e-9);
  EXPECT_EQ(rollout.samples.back().chaser.v.norm(), 0.0);
  EXPECT_EQ(rollout.samples.size(), 800u);
}

TEST(Mission, TheTwelveAreWhatTheyAreSaidToBe) {
  for (int number = 1; number <= 12; ++number) {
    const Mission m = LoadMission("S" + std::to_string(number));
    constexpr int kObstacles[] = {24, 40, 60, 84};
    EXPECT_EQ(m.obstacles.size(), static_cast<size_t>(kObstacles[(number - 1) / 3]));
    EXPECT_EQ(m.seed, 1);
    EXPECT_EQ(m.duration, 50.0);
    EXPECT_EQ(m.planning.horizon, 5.0);
    EXPECT_NEAR(1.0 / std::sqrt(m.GrownShapes()[0](2, 2)), 6.0, 1e-9);
    const world::State start = StartState(m);
    EXPECT_NEAR((start.p - m.Target(0.0)).norm(), m.desired_distance, 1e-9);
    EXPECT_NEAR(start.v.norm(), 1.0, 0.02) << "moves as the target does";
    double worst = 0.0;
    for (double t = 0.0; t < 50.0; t += 0.5) {
      const world::Trajectory fit = FitTarget(m, t, 5.0);
      for (double s = 0.0; s <= 5.0; s += 0.1)
        worst = std::max(worst, (fit.Position(t + s) - m.Target(t + s)).norm());
    }
    EXPECT_LT(worst, 0.06) << m.name;
  }
}

/// Every number of the planner's parameters.
std::string ParametersOf(const std::string& scenario) {
  planning::PlanningConfig config = LoadMission(scenario).planning;
  std::string text;
  const auto add = [&](const char* name, auto& value, const char*) {
    if constexpr (std::is_arithmetic_v<std::decay_t<decltype(value)>>)
      text += std::string(name) + " " + std::to_string(value) + "\n";
  };
  config.planner.Visit(add);
  return text;
}

TEST(Mission, OneParameterSetForAllTwelve) {
  for (int number = 2; number <= 12; ++number)
    EXPECT_EQ(ParametersOf("S" + std::to_string(number)), ParametersOf("S1")) << "S" << number;
}

TEST(Mission, OtherObstaclesThanEllipsoidsAreRefused) {
  try {
    LoadMission("deploy/scenarios/gym.yaml");
    FAIL();
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("upright ellipsoids only"), std::string::npos);
  }
}

}  // namespace
}  // namespace chase::compare
