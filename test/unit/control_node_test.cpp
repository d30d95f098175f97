#include "services/control/control_node.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "chase/attitude_setpoint_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/lockstep.h"

namespace chase::control {
namespace {

constexpr int64_t kStart = 1'700'000'000'000'000;  // microseconds

class Silent : public bus::Node {};

/// The node on an in-memory bus, with a hand on both ends.
class Bench {
 public:
  Bench() {
    lockstep_.Add("test", 0, [this](bus::Bus& bus) {
      bus_ = &bus;
      bus.Subscribe<attitude_setpoint_t>(
          "ATTITUDE_SETPOINT", [this](const attitude_setpoint_t& m) { out.push_back(m); });
      return std::make_unique<Silent>();
    });
    lockstep_.Add("control", 0, [this](bus::Bus& bus) {
      auto node = std::make_unique<ControlNode>(bus, ControlConfig{});
      node_ = node.get();
      return node;
    });
  }

  void SendPlan(int64_t utime, const Eigen::Vector3d& p, double duration = 2.0) {
    plan_t m{};
    m.utime = utime;
    m.position = bus::ToMessage(
        world::Trajectory::Constant(p, bus::Seconds(utime, kStart), duration), kStart);
    m.target = m.position;
    m.n_yaw = 1;
    m.yaw = {0.0};
    bus_->Publish("PLAN", m);
  }

  void SendPose(int64_t utime, int8_t health = pose_t::HEALTH_OK) {
    pose_t m{};
    m.utime = utime;
    m.orientation[0] = 1.0;
    m.health = health;
    bus_->Publish("POSE", m);
    lockstep_.RunUntil(utime);
  }

  const ControlNode& node() const { return *node_; }
  std::vector<attitude_setpoint_t> out;

 private:
  bus::Lockstep lockstep_{kStart};
  bus::Bus* bus_ = nullptr;
  ControlNode* node_ = nullptr;
};

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
  bench.SendPlan(kStart + 100'000, {1, 0, 0});
  bench.SendPose(kStart + 99'000);
  EXPECT_NEAR(bench.out.back().orientation[2], 0.0, 1e-9);
  bench.SendPose(kStart + 100'000);
  EXPECT_GT(bench.out.back().orientation[2], 0.05);  // nose down towards +x
}

TEST(ControlNode, HoldsAndComplainsWhenThePlanIsStale) {
  Bench bench;
  bench.SendPlan(kStart, {0, 0, 0}, 1.0);
  bench.SendPose(kStart);
  bench.SendPose(kStart + 5'000'000);
  EXPECT_NEAR(bench.out.back().thrust, 9.81, 1e-6);
  EXPECT_EQ(bench.node().Report().state, bus::NodeReport::State::kDegraded);
}

TEST(ControlNode, IsLevelWhilePoseIsLost) {
  Bench bench;
  bench.SendPlan(kStart, {5, 0, 0});
  bench.SendPose(kStart);
  bench.SendPose(kStart + 5000, pose_t::HEALTH_LOST);
  EXPECT_NEAR(bench.out.back().orientation[0], 1.0, 1e-9);
  EXPECT_LT(bench.out.back().thrust, 9.81);
  EXPECT_EQ(bench.node().Report().state, bus::NodeReport::State::kFailed);
  bench.SendPose(kStart + 10'000, pose_t::HEALTH_DEGRADED);
  EXPECT_GT(bench.out.back().orientation[2], 0.05);
}

}  // namespace
}  // namespace chase::control
