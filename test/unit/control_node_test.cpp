#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "test/unit/control_node_bench.h"

namespace chase::control {
namespace {

using test::Bench;
using test::kStart;

TEST(ControlNode, AnswersEveryPoseWithItsOwnStamp) {
  Bench bench;
  bench.SendPlan(kStart, {0, 0, 0});
  for (int i = 0; i < 10; ++i) bench.SendPose(kStart + 5000 * i);
  ASSERT_EQ(bench.out.size(), 10U);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(bench.out[i].utime, kStart + 5000 * i);
    EXPECT_EQ(bench.out[i].seq, i);
    EXPECT_NEAR(bench.out[i].thrust, 9.81, 1e-9);
    EXPECT_NEAR(bench.out[i].orientation[0], 1.0, 1e-9);
  }
  EXPECT_EQ(bench.node().Report().state, bus::NodeReport::State::kOk);
}

TEST(ControlNode, SaysNothingWithoutPlan) {
  Bench bench;
  for (int i = 0; i < 10; ++i) bench.SendPose(kStart + 5000 * i);
  EXPECT_TRUE(bench.out.empty());
  EXPECT_EQ(bench.node().Report().state, bus::NodeReport::State::kStarting);
}

TEST(ControlNode, TurnsToANewPlanAtItsUtime) {
  Bench bench;
  bench.SendPlan(kStart, {0, 0, 0});
  bench.SendPose(kStart);
  bench.SendPlan(kStart + 100'000, {0.25, 0, 0});
  bench.SendPose(kStart + 99'000);
  EXPECT_NEAR(bench.out.back().orientation[2], 0.0, 1e-9);
  bench.SendPose(kStart + 100'000);
  EXPECT_GT(bench.out.back().orientation[2], 0.03);  // nose down towards +x
}

TEST(ControlNode, HoldsAndComplainsWhenThePlanIsStale) {
  Bench bench;
  bench.SendPlan(kStart, {0, 0, 0}, 1.0);
  for (int i = 0; i <= 100; ++i) bench.SendPose(kStart + 50'000 * i);
  EXPECT_NEAR(bench.out.back().thrust, 9.81, 1e-6);
  EXPECT_EQ(bench.node().Report().state, bus::NodeReport::State::kDegraded);
}

TEST(ControlNode, BrakesWhilePoseIsLost) {
  Bench bench;
  bench.SendPlan(kStart, {5, 0, 0});
  bench.SendPose(kStart);
  bench.SendPose(kStart + 5000, pose_t::HEALTH_LOST);
  EXPECT_NEAR(bench.out.back().orientation[0], 1.0, 1e-9);
  EXPECT_NEAR(bench.out.back().thrust, 9.81, 1e-6);
  EXPECT_EQ(bench.node().Report().state, bus::NodeReport::State::kFailed);
}

TEST(ControlNode, GoesByTheUncertaintyNotByTheHealthAlone) {
  const double landing = ControlConfig().land_speed;
  const auto after = [](double seconds, double sigma, double speed_sigma, int8_t health) {
    Bench bench;
    bench.SendPlan(kStart, {0, 0, 0});
    bench.SendPose(kStart);
    for (int i = 1; i < 12 + std::lround(seconds / 0.005); ++i)
      bench.SendPose(kStart + 5000 * i, health, 0, sigma, speed_sigma);
    return std::pair(bench.tracking.back().following, bench.out.back().thrust);
  };
  // Where the body is in the world matters to no plan, and plans allow for a frame that drifts.
  EXPECT_EQ(after(0.0, 1.0, 0.99 * landing, pose_t::HEALTH_DEGRADED).first, +tracking_t::PLAN);
  EXPECT_EQ(after(0.0, 0.0, 0.5 * landing, pose_t::HEALTH_LOST).first, +tracking_t::BRAKE);
  EXPECT_EQ(after(0.0, 0.0, 1.01 * landing, pose_t::HEALTH_DEGRADED).first, +tracking_t::BRAKE);
  const double blind = 9.81 - ControlConfig().lost_descent;  // at most, by a doubtful velocity
  for (const auto health : {pose_t::HEALTH_DEGRADED, pose_t::HEALTH_LOST}) {
    const auto [following, thrust] =
        after(2.1, 0.0, 1.01 * ControlConfig().UsableVelocitySigma(), health);
    EXPECT_EQ(following, +tracking_t::LAND);
    EXPECT_LE(thrust, blind);
  }
  EXPECT_LT(after(2.1, 0.0, 0.5 * landing, pose_t::HEALTH_LOST).second, blind - 1.0);
}

TEST(ControlNode, FliesWhatIsCertifiedAgainstTheListThatItHeard) {
  Bench bench;
  bench.SendWall(kStart);
  bench.SendPose(kStart);
  bench.Send(Bench::Certified(kStart + 5000, {0, 0, 0}));
  bench.SendPose(kStart + 5000);
  EXPECT_EQ(bench.out.size(), 1U);
  EXPECT_NE(bench.node().Report().detail.find("1 plans, 0 refused"), std::string::npos)
      << bench.node().Report().detail;
}

TEST(ControlNode, RefusesAPlanForAListThatLeavesSomeOut) {
  for (const int n_cut : {0, 1}) {
    Bench bench;
    bench.SendWall(kStart, 0, n_cut);
    bench.SendPose(kStart);
    bench.Send(Bench::Certified(kStart + 5000, {0, 0, 0}));
    bench.SendPose(kStart + 5000);
    EXPECT_EQ(bench.out.empty(), n_cut > 0);
  }
}

TEST(ControlNode, RefusesWhatIsNotCertified) {
  const auto answers = [](auto change, bool names_list = true, bool heard = true) {
    Bench bench(names_list);
    if (heard) bench.SendWall(kStart);
    bench.SendPose(kStart);
    plan_t plan = Bench::Certified(kStart + 5000, {0, 0, 0});
    change(&plan);
    bench.Send(plan);
    bench.SendPose(kStart + 5000);
    EXPECT_EQ(bench.out.empty(),
              bench.node().Report().detail.find("1 plans, 1 refused") != std::string::npos);
    return bench.out.size();
  };
  EXPECT_EQ(answers([](plan_t*) {}), 1U);
  EXPECT_EQ(answers([](plan_t*) {}, false), 0U);  // names no list
  EXPECT_EQ(answers([](plan_t*) {}, true, false), 0U);
  EXPECT_EQ(answers([](plan_t* m) { m->certified_clearance = -1.0; }), 0U);
  EXPECT_EQ(answers([](plan_t* m) { m->proofs[0].obstacle = 8; }), 0U);
  EXPECT_EQ(answers([](plan_t* m) { m->proofs[0].separations[0].normal[0] = 1.0; }), 0U);
  EXPECT_EQ(answers([](plan_t* m) { m->hard_radius = m->proofs[0].radius = 0.1; }), 0U);
  EXPECT_EQ(answers([](plan_t* m) { m->position.coefficients[0] = 1.7; }), 0U);
  const ControlConfig config;
  const double most = config.drone_radius + 0.9 * config.tracking_tube;  // short of the tube
  EXPECT_EQ(answers([&](plan_t* m) { m->hard_radius = m->proofs[0].radius = most; }), 0U);
}

TEST(ControlNode, RefusesAPlanForObstaclesOfLongAgo) {
  const auto flies = [](int newer) {
    Bench bench;
    bench.SendWall(kStart);
    bench.SendPose(kStart);
    for (int i = 0; i < newer; ++i) bench.SendWall(kStart + 1000);
    bench.Send(Bench::Certified(kStart + 5000, {0, 0, 0}));  // it has heard the first list only
    bench.SendPose(kStart + 5000);
    return bench.out.size() == 1U;
  };
  EXPECT_TRUE(flies(0));
  EXPECT_TRUE(flies(7));
  EXPECT_FALSE(flies(8));
}

// Whoever lists has fallen silent, or goes by another clock.
TEST(ControlNode, RefusesAPlanForObstaclesOfAnotherTime) {
  const auto flies = [](int64_t age) {
    Bench bench;
    bench.RunUntil(kStart + 495'000);
    bench.SendWall(kStart + 500'000 - age);
    bench.SendPose(kStart + 495'000);
    bench.Send(Bench::Certified(kStart + 500'000, {0, 0, 0}));
    bench.SendPose(kStart + 500'000);
    return bench.out.size() == 1U;
  };
  EXPECT_TRUE(flies(0));
  EXPECT_TRUE(flies(390'000));
  EXPECT_FALSE(flies(410'000));
  EXPECT_FALSE(flies(-200'000));
}

TEST(ControlNode, AnotherFrameVoidsPlansAndLists) {
  Bench bench;
  bench.SendWall(kStart);
  bench.SendPose(kStart);
  bench.Send(Bench::Certified(kStart, {0, 0, 0}));
  bench.SendPose(kStart + 5000);
  EXPECT_EQ(bench.node().Report().state, bus::NodeReport::State::kOk);
  bench.SendPose(kStart + 10'000, pose_t::HEALTH_OK, 1);
  EXPECT_NE(bench.node().Report().detail.find("no plan: braking"), std::string::npos);
  bench.Send(Bench::Certified(kStart + 10'000, {0, 0, 0}));  // in the frame that was
  bench.SendPlan(kStart + 10'000, {0, 0, 0});
  bench.SendWall(kStart + 10'000, 0);
  bench.SendPose(kStart + 15'000, pose_t::HEALTH_OK, 1);
  EXPECT_NE(bench.node().Report().detail.find("no plan: braking"), std::string::npos);
  plan_t plan = Bench::Certified(kStart + 15'000, {0, 0, 0});
  plan.epoch = 1;
  bench.SendWall(kStart + 15'000, 1);
  bench.SendPose(kStart + 20'000, pose_t::HEALTH_OK, 1);
  bench.Send(plan);
  bench.SendPose(kStart + 25'000, pose_t::HEALTH_OK, 1);
  EXPECT_EQ(bench.node().Report().state, bus::NodeReport::State::kOk)
      << bench.node().Report().detail;
}

TEST(ControlNode, BrakesWhenNoPoseComesAndLeavesTheRestToTheAutopilot) {
  Bench bench;
  bench.RunUntil(kStart + 1'000'000);
  EXPECT_TRUE(bench.out.empty());
  bench.SendPlan(kStart + 1'000'000, {5, 0, 0});
  bench.SendPose(kStart + 1'000'000);
  bench.SendPose(kStart + 1'005'000);
  ASSERT_EQ(bench.out.size(), 2U);
  EXPECT_LT(bench.out.back().orientation[0], 0.999);
  const double forward = bench.out.back().orientation[2];
  bench.RunUntil(kStart + 1'099'000);
  EXPECT_EQ(bench.out.size(), 2U);
  bench.RunUntil(kStart + 1'200'000);
  ASSERT_GT(bench.out.size(), 2U);
  EXPECT_LT(bench.out.back().orientation[2] * forward, 0.0);  // against what it has asked for
  EXPECT_EQ(bench.tracking.back().following, +tracking_t::BRAKE);
  bench.RunUntil(kStart + 4'000'000);
  EXPECT_NEAR(bench.out.back().orientation[0], 1.0, 1e-3);
  const size_t n = bench.out.size();
  EXPECT_NEAR(static_cast<double>(n), 40.0, 4.0);
  bench.RunUntil(kStart + 5'000'000);
  EXPECT_EQ(bench.out.size(), n);
}

TEST(ControlNode, DoesNotGoBackToPosesThatWereQueuedWhileTheirSenderHung) {
  Bench bench;
  bench.SendPlan(kStart, {5, 0, 0});
  bench.SendPose(kStart);
  bench.RunUntil(kStart + 1'000'000);
  const size_t n = bench.out.size();
  for (int i = 1; i <= 50; ++i) bench.SendPose(kStart + 5000 * i);
  bench.RunUntil(kStart + 1'001'000);
  EXPECT_EQ(bench.out.size(), n);
  bench.SendPose(kStart + 1'005'000);
  EXPECT_EQ(bench.out.size(), n + 1);
}

TEST(ControlNode, GoesByPosesThatAreAlwaysLateForWantOfOthers) {
  Bench bench;
  bench.SendPlan(kStart, {0, 0, 0});
  bench.SendPose(kStart);
  const auto late = [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      bench.RunUntil(kStart + 300'000 + 5000 * i);
      bench.SendPose(kStart + 5000 * i);
    }
    return bench.tracking.back().following;
  };
  EXPECT_EQ(late(0, 300), +tracking_t::BRAKE) << "by dead reckoning";
  EXPECT_EQ(late(300, 450), +tracking_t::STOP) << "which is worth no more";
}

// Told to drift at 1 m/s all the same, it brakes against that, less what it has asked for since.
TEST(ControlNode, BrakesByWhatLatePosesSayThatTheBodyDid) {
  Bench bench;
  bench.SendPlan(kStart, {0, 0, 0});
  bench.SendPose(kStart);
  bench.velocity = {1, 0, 0};
  for (int i = 0; i < 200; ++i) {
    bench.RunUntil(kStart + 300'000 + 5000 * i);
    bench.SendPose(kStart + 5000 * i);
  }
  ASSERT_EQ(bench.tracking.back().following, +tracking_t::BRAKE);
  EXPECT_LT(bench.out.back().orientation[2], -0.05);  // nose up
  EXPECT_GT(bench.out.back().orientation[2], -0.15);  // -0.2 against 1 m/s
}

TEST(ControlNode, SaysTwentyTimesASecondHowWellItFollows) {
  Bench bench;
  bench.SendPose(kStart);
  ASSERT_EQ(bench.tracking.size(), 1U);
  EXPECT_EQ(bench.tracking[0].following, +tracking_t::NONE);
  bench.SendPlan(kStart + 5000, {0.1, 0, 0}, 1.0);
  for (int i = 1; i <= 400; ++i) bench.SendPose(kStart + 5000 * i);
  EXPECT_EQ(bench.tracking.size(), 41U);
  EXPECT_EQ(bench.tracking[5].following, +tracking_t::PLAN);
  EXPECT_NEAR(bench.tracking[5].error[0], 0.1, 1e-9);
  EXPECT_GE(bench.tracking[5].bound, 0.1);
  EXPECT_EQ(bench.tracking.back().following, +tracking_t::STOP);
  EXPECT_NE(bench.tracking.back().reason, "");
}

}  // namespace
}  // namespace chase::control
