// The node's contract: what comes out for what goes in, on a bus in memory.
#include "services/prediction/prediction_node.h"

#include <gtest/gtest.h>

#include <map>

#include "chase/prediction_t.hpp"

namespace chase::prediction {
namespace {

class MemoryBus : public bus::Bus {
 public:
  template <class T>
  void Inject(const std::string& channel, const T& message) {
    Bytes bytes(static_cast<size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    handlers_.at(channel)(bytes.data(), bytes.size());
  }
  int64_t Now() const override { return 0; }
  std::vector<prediction_t> sent;

 protected:
  void SubscribeRaw(const std::string& channel, RawHandler handler) override {
    handlers_[channel] = std::move(handler);
  }
  void PublishRaw(const std::string& channel, Bytes bytes) override {
    ASSERT_EQ(channel, "PREDICTION");
    prediction_t message;
    ASSERT_GT(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
    ASSERT_EQ(bus::Problem(message), "");
    sent.push_back(message);
  }

 private:
  std::map<std::string, RawHandler> handlers_;
};

constexpr int8_t kOk = prediction_t::OK, kNoTarget = prediction_t::NO_TARGET;
constexpr int64_t kStart = 1'700'000'000'000'000;

struct PredictionNodeTest : ::testing::Test {
  void Target(double t, int8_t state, double offset = 0.0) {
    target_t m{};
    m.utime = kStart + static_cast<int64_t>(t * 1e6);
    m.seq = seq_++;
    m.state = state;
    m.mean[0] = 0.8 * t;
    m.mean[1] = offset;
    m.mean[2] = 0.5;
    for (int i = 0; i < 9; i += 4) m.covariance[i] = 0.0016;
    m.radius = 0.15;
    m.height = 0.5;
    bus.Inject("TARGET", m);
  }
  void Drive(double from, double to, int8_t state = target_t::TRACKING) {
    for (int i = 0; from + 0.05 * i < to - 1e-6; ++i) Target(from + 0.05 * i, state);
  }
  void Obstacle(double t, double x, double y, int8_t kind = obstacle_t::STATIC) {
    obstacles_t m{};
    m.utime = kStart + static_cast<int64_t>(t * 1e6);
    m.n_obstacles = 1;
    obstacle_t o{};
    o.kind = kind;
    o.center.utime = m.utime;
    o.center.duration = 1.0;
    o.center.coefficients = {x, y, 0.5};
    o.center.n_coefficients = 3;
    o.shape[0] = o.shape[3] = 12.0;
    o.shape[5] = 0.3;
    m.obstacles = {o};
    bus.Inject("OBSTACLES", m);
  }
  const prediction_t& last() const { return bus.sent.back(); }

  MemoryBus bus;
  PredictionNode node{bus, PredictionConfig{}};
  int32_t seq_ = 0;
};

TEST_F(PredictionNodeTest, FirstPredictionThenExpiry) {
  Drive(0.0, 2.0);
  ASSERT_GE(bus.sent.size(), 3u);
  EXPECT_EQ(bus.sent[0].verdict, kNoTarget);  // too few observations yet
  EXPECT_EQ(bus.sent[1].verdict, kOk);
  EXPECT_EQ(bus.sent[1].trigger, 0);
  for (size_t i = 2; i < bus.sent.size(); ++i) {
    EXPECT_EQ(bus.sent[i].trigger, 2);
    EXPECT_EQ(bus.sent[i].utime - bus.sent[i - 1].utime, 200000);
  }
  EXPECT_EQ(last().target.utime, last().utime);
  EXPECT_DOUBLE_EQ(last().target.duration, 2.5);
  EXPECT_DOUBLE_EQ(last().radius, 0.15);
  EXPECT_NEAR(last().target.coefficients[0],
              0.8 * 1e-6 * static_cast<double>(last().utime - kStart), 0.02);
  EXPECT_EQ(node.Report().state, bus::NodeReport::State::kOk);
}

TEST_F(PredictionNodeTest, DeviationTriggersAtOnce) {
  Drive(0.0, 2.05);
  const size_t before = bus.sent.size();
  ASSERT_LT(last().utime, kStart + 2050000);
  Target(2.1, target_t::TRACKING, 0.22);
  ASSERT_EQ(bus.sent.size(), before + 1);
  EXPECT_EQ(last().trigger, 1);
}

TEST_F(PredictionNodeTest, ObstacleInTheWayTriggersAndIsAvoided) {
  Drive(0.0, 2.05);
  const size_t before = bus.sent.size();
  Obstacle(2.04, 2.9, 0.25);
  Target(2.1, target_t::TRACKING);
  ASSERT_EQ(bus.sent.size(), before + 1);
  EXPECT_EQ(last().trigger, 3);
}

TEST_F(PredictionNodeTest, OldMovingObstaclesAreForgotten) {
  Obstacle(0.0, 2.9, 0.25, obstacle_t::MOVING);
  Drive(0.0, 0.95);
  EXPECT_EQ(last().verdict, kOk);
  EXPECT_EQ(last().checked, 1);  // the first one passes: no obstacle is known
}

TEST_F(PredictionNodeTest, LossIsSaidOnceThenAtTwoHertzAndReacquired) {
  Drive(0.0, 1.0);
  const size_t before = bus.sent.size();
  Drive(1.0, 2.45, target_t::LOST);
  ASSERT_EQ(bus.sent.size(), before + 3);
  EXPECT_EQ(bus.sent[before].verdict, kNoTarget);
  EXPECT_EQ(bus.sent[before].utime, kStart + 1000000);
  EXPECT_EQ(bus.sent[before + 1].utime, kStart + 1500000);
  EXPECT_FALSE(last().reason.empty());
  Drive(2.5, 3.0);
  EXPECT_EQ(bus.sent[before + 3].verdict, kNoTarget);  // too few observations
  EXPECT_EQ(bus.sent[before + 4].trigger, 4);
  EXPECT_EQ(last().verdict, kOk);
}

TEST_F(PredictionNodeTest, OccludedTargetIsExtrapolatedUntilTheAgeLimit) {
  Drive(0.0, 1.0);
  // While occluded the means drift off; they must not enter the fit.
  for (double t = 1.0; t < 2.3; t += 0.05) Target(t, target_t::OCCLUDED, 5.0);
  EXPECT_EQ(last().verdict, kOk);
  EXPECT_EQ(last().trigger, 2);
  EXPECT_LT(std::abs(last().target.coefficients[1]), 0.2);
  for (double t = 2.3; t < 3.0; t += 0.05) Target(t, target_t::OCCLUDED, 5.0);
  EXPECT_EQ(last().verdict, kNoTarget);
}

TEST_F(PredictionNodeTest, SurvivesDuplicatesAndStampsOutOfOrder) {
  Drive(0.0, 1.0);
  const size_t before = bus.sent.size();
  Target(0.95, target_t::TRACKING);
  Target(0.5, target_t::TRACKING);
  Target(0.72, target_t::TRACKING);
  EXPECT_EQ(bus.sent.size(), before);
  Drive(1.0, 1.5);
  EXPECT_EQ(last().verdict, kOk);
}

TEST_F(PredictionNodeTest, StartsAnewWhenTheClockIsSetBack) {
  for (const double by : {0.5, 3.0, 60.0}) {
    PredictionNodeTest::SetUp();
    PredictionNode again{bus, PredictionConfig{}};
    bus.sent.clear();
    Drive(100.0, 103.0);
    ASSERT_EQ(last().verdict, kOk);
    Drive(103.0 - by, 103.5 - by);
    EXPECT_EQ(last().verdict, kOk) << by;
    EXPECT_LE(last().utime, kStart + static_cast<int64_t>((103.5 - by) * 1e6)) << by;
    EXPECT_LT(last().target.coefficients[0] - 0.8 * (103.5 - by), 0.2) << by;
  }
}

TEST_F(PredictionNodeTest, SameInputSameOutput) {
  Drive(0.0, 1.5);
  MemoryBus other_bus;
  std::swap(other_bus.sent, bus.sent);
  PredictionNodeTest::SetUp();
  PredictionNode again{bus, PredictionConfig{}};
  seq_ = 0;
  Drive(0.0, 1.5);
  ASSERT_EQ(bus.sent.size(), other_bus.sent.size());
  for (size_t i = 0; i < bus.sent.size(); ++i)
    EXPECT_EQ(bus.sent[i].target.coefficients, other_bus.sent[i].target.coefficients);
}

}  // namespace
}  // namespace chase::prediction
