#include "services/control/control_node.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/flight_state_t.hpp"
#include "chase/tracking_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/lockstep.h"

namespace chase::control {
namespace {

constexpr int64_t kStart = 1'700'000'000'000'000;  // microseconds

class Silent : public bus::Node {};

/// The node on an in-memory bus, with a hand on both ends.
class Bench {
 public:
  explicit Bench(bool hears_obstacles = true, const ControlConfig& config = {}) {
    lockstep_.Add("planning", 0, [this, hears_obstacles](bus::Bus& bus) {
      bus_ = &bus;
      bus.Subscribe<attitude_setpoint_t>(
          "ATTITUDE_SETPOINT", [this](const attitude_setpoint_t& m) { out.push_back(m); });
      bus.Subscribe<tracking_t>("TRACKING", [this](const tracking_t& m) { tracking.push_back(m); });
      bus.Subscribe<flight_state_t>("FLIGHT_STATE", [](const flight_state_t&) {});
      if (hears_obstacles) bus.Subscribe<obstacles_t>("OBSTACLES", [](const obstacles_t&) {});
      return std::make_unique<Silent>();
    });
    lockstep_.Add("control", 0, [this, config](bus::Bus& bus) {
      auto node = std::make_unique<ControlNode>(bus, config);
      node_ = node.get();
      return node;
    });
  }

  /// A hover that nobody has certified: the last resort.
  static plan_t Hover(int64_t utime, const Eigen::Vector3d& p, double duration = 2.0) {
    plan_t m{};
    m.utime = utime;
    m.verdict = plan_t::WAIT;
    m.certified_clearance = -1.0;
    m.position = bus::ToMessage(
        world::Trajectory::Constant(p, bus::Seconds(utime, kStart), duration), kStart);
    m.target = m.position;
    m.n_yaw = 1;
    m.yaw = {0.0};
    return m;
  }
  void SendPlan(int64_t utime, const Eigen::Vector3d& p, double duration = 2.0) {
    Send(Hover(utime, p, duration));
  }
  void Send(const plan_t& plan) { bus_->Publish("PLAN", plan); }

  /// A hover that is certified off the wall that SendWall lists.
  static plan_t Certified(int64_t utime, const Eigen::Vector3d& p) {
    plan_t m = Hover(utime, p);
    m.verdict = plan_t::CHASE;
    m.certified_clearance = 0.1;
    m.hard_radius = ControlConfig{}.hard_radius();
    m.sigmas = ControlConfig{}.sigmas;
    m.n_proofs = 1;
    m.proofs.resize(1);
    m.proofs[0].obstacle = 7;
    m.proofs[0].radius = m.hard_radius;
    m.proofs[0].n_separations = 1;
    m.proofs[0].separations = {{0.0, 1.0, {-1.0, 0.0, 0.0}}};
    return m;
  }

  /// A wall 2 m ahead.
  void SendWall(int64_t utime, int32_t epoch = 0) {
    obstacles_t m{};
    m.utime = utime;
    m.epoch = epoch;
    m.n_obstacles = 1;
    world::Obstacle wall;
    wall.id = 7;
    wall.solid = world::Obstacle::Solid::kBox;
    wall.half = {0.1, 5.0, 5.0};
    wall.shape = (3.0 * wall.half.cwiseAbs2()).cwiseInverse().asDiagonal();
    wall.center = world::Trajectory::Constant({2, 0, 0}, bus::Seconds(utime, kStart), 1.0);
    m.obstacles = {bus::ToMessage(wall, kStart)};
    bus_->Publish("OBSTACLES", m);
  }

  void SendPose(int64_t utime, int8_t health = pose_t::HEALTH_OK, int32_t epoch = 0,
                double sigma = 0.0, double speed_sigma = 0.0) {
    pose_t m{};
    m.utime = utime;
    m.epoch = epoch;
    m.orientation[0] = 1.0;
    m.health = health;
    for (int i = 0; i < 3; ++i) {
      m.local_covariance[10 * i] = sigma * sigma;
      m.local_covariance[10 * (i + 3)] = speed_sigma * speed_sigma;
    }
    bus_->Publish("POSE", m);
    RunUntil(utime);
  }

  void RunUntil(int64_t utime) {
    latest_ = std::max(latest_, utime);
    lockstep_.RunUntil(latest_);
  }
  void SendState(int8_t state, const std::string& sender = "mission",
                 const std::optional<Eigen::Vector3d>& home = {}, int64_t age = 0) {
    if (!mission_) mission_ = lockstep_.Connect();
    mission_->SetIdentity({sender, "", 0});
    flight_state_t m{};
    m.utime = mission_->Now() - age;
    m.state = state;
    m.has_home = home ? 1 : 0;
    if (home) bus::Set(m.home, *home);
    mission_->Publish("FLIGHT_STATE", m);
  }

  const ControlNode& node() const { return *node_; }
  std::vector<attitude_setpoint_t> out;
  std::vector<tracking_t> tracking;

 private:
  int64_t latest_ = kStart;
  bus::Lockstep lockstep_{kStart};
  bus::Bus* bus_ = nullptr;
  ControlNode* node_ = nullptr;
  std::unique_ptr<bus::Bus> mission_;
};

TEST(ControlNode, LandsWhenTheMissionSaysSoAndNobodyElse) {
  Bench bench;
  int64_t t = kStart;
  const auto following_after = [&](int8_t state, const std::string& sender) {
    bench.SendState(state, sender);
    bench.RunUntil(t);
    bench.SendPlan(t, {0, 0, 0});
    for (int i = 0; i < 20; ++i) bench.SendPose(t += 5000);
    return int{bench.tracking.back().following};
  };
  EXPECT_EQ(following_after(flight_state_t::HOLD, "mission"), int{tracking_t::PLAN});
  EXPECT_EQ(following_after(flight_state_t::LAND, "planning"), int{tracking_t::PLAN});
  EXPECT_EQ(following_after(flight_state_t::LAND, "mission"), int{tracking_t::LAND});
  EXPECT_EQ(bench.tracking.back().reason, "landing");
  EXPECT_EQ(bench.node().Report().state, bus::NodeReport::State::kOk);
  EXPECT_EQ(following_after(flight_state_t::HOLD, "mission"), int{tracking_t::PLAN});
}

TEST(ControlNode, ComesDownOnlyByAPlanThatWasMadeToLand) {
  Bench bench;
  int64_t t = kStart;
  const auto following = [&] {
    for (int i = 0; i < 20; ++i) bench.SendPose(t += 5000);
    return int{bench.tracking.back().following};
  };
  bench.SendState(flight_state_t::HOLD);
  bench.SendPlan(t, {0, 0, 0});
  EXPECT_EQ(following(), int{tracking_t::PLAN});
  bench.SendState(flight_state_t::LAND);
  EXPECT_EQ(following(), int{tracking_t::PLAN}) << "of before";
  bench.SendState(flight_state_t::LAND);
  bench.SendPlan(t, {3, 0, 0});
  bench.SendPlan(t, {0, 0, 0});
  EXPECT_EQ(following(), int{tracking_t::LAND});
}

/// Is a plan from rest to rest flown by a body `at` [m] from the take-off place, within a fence of
/// 1 m around that and 2 m above?
bool IsFlown(const Eigen::Vector3d& at, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
             bool knows_home = true, int8_t verdict = plan_t::CHASE) {
  ControlConfig config;
  config.geofence.polygon = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  config.geofence.ceiling = 2.0;
  Bench bench(true, config);
  bench.SendState(flight_state_t::CHASE, "mission",
                  knows_home ? std::optional<Eigen::Vector3d>(-at) : std::nullopt);
  bench.SendWall(kStart);
  bench.SendPose(kStart);  // at [0, 0, 0]
  plan_t plan = Bench::Certified(kStart + 5000, from - at);
  plan.verdict = verdict;
  plan.position.n_coefficients = 18;
  for (const double share : {0.0, 0.0, 10.0, -15.0, 6.0})
    for (int i = 0; i < 3; ++i) plan.position.coefficients.push_back(share * (to - from)[i]);
  bench.Send(plan);
  bench.SendPose(kStart + 5000);
  return !bench.out.empty();
}

TEST(ControlNode, FliesNoPlanThatLeavesTheFence) {
  const Eigen::Vector3d middle(0, 0, 0), inside(0.85, 0, 0), outside(1.1, 0, 0), above(0, 0, 2.1);
  EXPECT_TRUE(IsFlown(middle, middle, {0.85, 0, 1.85}));
  EXPECT_FALSE(IsFlown(middle, middle, outside));
  EXPECT_FALSE(IsFlown(middle, middle, above));
  EXPECT_FALSE(IsFlown(middle, middle, {0.9, 0, 0})) << "the body keeps to its plan by 0.12 m";
  EXPECT_TRUE(IsFlown({0.95, 0, 0}, {0.95, 0, 0}, {0.9, 0, 0})) << "but leaves the edge";
  EXPECT_FALSE(IsFlown(inside, outside, {1.3, 0, 0})) << "planning is ahead of the body";
  EXPECT_TRUE(IsFlown({1.5, 0, 0}, {1.5, 0, 0}, {1.2, 0, 0})) << "a way back";
  EXPECT_FALSE(IsFlown({1.5, 0, 0}, {1.5, 0, 0}, {1.6, 0, 0}));
  EXPECT_TRUE(IsFlown(middle, middle, outside, true, plan_t::BRAKE))
      << "what else there is stops later";
  EXPECT_TRUE(IsFlown(middle, middle, outside, true, plan_t::ESCAPE));
  EXPECT_FALSE(IsFlown(middle, middle, inside, false)) << "nobody knows where the fence is";
}

TEST(ControlNode, CutsTheMotorsInTheAirWhenTheFlightIsOverAndForGood) {
  Bench bench;
  int64_t t = kStart;
  bench.SendPlan(t, {0, 0, 0});
  for (int i = 0; i < 20; ++i) bench.SendPose(t += 5000);
  ASSERT_EQ(int{bench.out.back().motors}, int{attitude_setpoint_t::MOTORS_ON});
  bench.SendState(flight_state_t::DONE, "planning");
  bench.SendPose(t += 5000);
  EXPECT_EQ(int{bench.out.back().motors}, int{attitude_setpoint_t::MOTORS_ON})
      << "not its business";
  bench.SendState(flight_state_t::DONE);
  bench.SendPose(t += 5000);
  EXPECT_EQ(int{bench.out.back().motors}, int{attitude_setpoint_t::MOTORS_OFF});
  EXPECT_EQ(bench.out.back().thrust, 0.0);
  bench.SendState(flight_state_t::CHASE);
  bench.SendPlan(t, {0, 0, 0});
  for (int i = 0; i < 20; ++i) bench.SendPose(t += 5000);
  EXPECT_EQ(int{bench.out.back().motors}, int{attitude_setpoint_t::MOTORS_OFF});
  EXPECT_EQ(bench.tracking.back().reason, "the flight is over: motors off");
}

// As of a recording that somebody plays.
TEST(ControlNode, HearsNoFlightStateThatIsTooOld) {
  Bench bench;
  bench.SendPlan(kStart, {0, 0, 0});
  bench.SendPose(kStart);
  bench.SendState(flight_state_t::DONE, "mission", {}, 2100000);
  bench.SendPose(kStart + 5000);
  EXPECT_EQ(int{bench.out.back().motors}, int{attitude_setpoint_t::MOTORS_ON});
  bench.SendState(flight_state_t::DONE, "mission", {}, 1900000);
  bench.SendPose(kStart + 10000);
  EXPECT_EQ(int{bench.out.back().motors}, int{attitude_setpoint_t::MOTORS_OFF});
}

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
  bench.SendPlan(kStart + 100'000, {0.8, 0, 0});
  bench.SendPose(kStart + 99'000);
  EXPECT_NEAR(bench.out.back().orientation[2], 0.0, 1e-9);
  bench.SendPose(kStart + 100'000);
  EXPECT_GT(bench.out.back().orientation[2], 0.05);  // nose down towards +x
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
