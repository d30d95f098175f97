// The ways home of planning's pilot under a mission that keeps a fence.
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "test/unit/mission_bench.h"
#include "test/unit/planning_flight.h"

namespace chase::mission {
namespace {

using Eigen::Vector3d;
using planning::Task;

const Vector3d kHome(3.0, -2.0, 0.4);  // frame W, m

/// A U about a gap: home at the foot of one arm, the other 10 m off;
/// around it are 134 m.
world::Geofence Horseshoe() {
  world::Geofence fence;
  fence.polygon = {{-2, -2}, {2, -2}, {2, 60}, {8, 60}, {8, -2}, {12, -2}, {12, 64}, {-2, 64}};
  fence.ceiling = 20.0;
  return fence;
}

/// Flies along `way` [m from home], then commands a return.
class Return {
 public:
  Return(const std::vector<Vector3d>& way, const world::Geofence& fence)
      : fence_(fence), flight_(kHome + way.front()), mission_(Config(fence)) {
    flight_.flying_before = true;
    flight_.pilot.SetFence(fence);
    mission_.pose.p = kHome;
    mission_.Fly(kHome + way.front());
    for (size_t i = 1; i < way.size(); ++i)
      for (int part = 1; part <= 40; ++part)
        Lead(kHome + way[i - 1] + 0.025 * part * (way[i] - way[i - 1]));
    EXPECT_TRUE(mission_.Command(Event::kReturn).accepted);
  }

  /// Why it landed, and after how long, s.
  std::pair<std::string, double> Fly() {
    const double start = mission_.t;
    while (state() == State::kReturn && mission_.t - start < 600.0) Step(Task::kReturn);
    EXPECT_EQ(state(), State::kLand);
    const std::pair result{mission_.mission.reason(), mission_.t - start};
    while (mission_.t - start < result.second + 10.0) Step(Task::kLand);
    return result;
  }

  Vector3d place() const { return flight_.Body().p - kHome; }

 private:
  static MissionConfig Config(const world::Geofence& fence) {
    MissionConfig config;
    config.geofence = fence;
    return config;
  }

  State state() const { return mission_.mission.state(); }

  void Step(Task task) {
    flight_.pilot.SetTask(task, kHome);
    flight_.Run(kTick);
    mission_.pose.p = flight_.Body().p;
    mission_.pose.v = flight_.Body().v;
    mission_.Run(kTick);
    EXPECT_EQ(fence_.Breach(place()), "") << place().transpose();
  }

  /// As a return to there would, straight on.
  void Lead(const Vector3d& there) {
    const Vector3d below = there - planning::PlanningConfig().takeoff_height * Vector3d::UnitZ();
    for (int i = 0; i < 600 && (flight_.Body().p - there).norm() > 0.3; ++i) {
      flight_.pilot.SetTask(Task::kReturn, below);
      flight_.Run(kTick);
    }
    flight_.pilot.SetTask(Task::kHold, kHome);
    flight_.Run(kTick);
    EXPECT_LT((flight_.Body().p - there).norm(), 0.3);
  }

  world::Geofence fence_;
  planning::test::Flight flight_;
  Bench mission_;
};

TEST(Return, FromAboveHomeItLandsAtOnceHoweverHighItIs) {
  for (const Vector3d& from : {Vector3d(0.1, 0.0, 12.0), Vector3d(0.0, 0.0, 30.0)}) {
    Return way({from}, {});
    const auto [reason, after] = way.Fly();
    EXPECT_EQ(reason, "back at the take-off place") << from.transpose();
    EXPECT_LT(after, 1.0) << from.transpose();
  }
}

/// Of a planner that has been started there, and knows no trail.
TEST(Return, FromAnywhereInsideTheFenceComesHome) {
  world::Geofence hall;
  hall.polygon = {{-20, -12}, {25, -12}, {25, 18}, {-20, 18}};
  hall.floor = -1.0;
  hall.ceiling = 30.0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    std::mt19937 random(seed);
    const auto within = [&](double low, double high) {
      return std::uniform_real_distribution(low, high)(random);
    };
    const double x = within(-19.0, 24.0), y = within(-11.0, 17.0), z = within(0.5, 29.0);
    Return way({{x, y, z}}, hall);
    const auto [reason, after] = way.Fly();
    EXPECT_EQ(reason, "back at the take-off place") << seed << ": " << x << " " << y << " " << z;
    EXPECT_LT(after, 20.0 + 2.5 * std::hypot(x, y)) << seed;
    EXPECT_LT(way.place().head<2>().norm(), MissionConfig().home_radius) << seed;
  }
}

TEST(Return, LeadsAroundTheGapOfAFenceTheWayItCame) {
  for (const double height : {1.5, 12.0}) {
    Return way({{0, 0, height}, {0, 62, height}, {10, 62, height}, {10, 0, height}}, Horseshoe());
    const auto [reason, after] = way.Fly();
    EXPECT_EQ(reason, "back at the take-off place") << height;
    EXPECT_LT(way.place().head<2>().norm(), MissionConfig().home_radius) << height;
  }
}

TEST(Return, WithoutAWayInsideTheFenceItLandsWhereItCannotGoOn) {
  for (const double height : {1.5, 12.0}) {
    Return way({{10, 0, height}}, Horseshoe());
    const auto [reason, after] = way.Fly();
    EXPECT_EQ(reason, "it gets no farther on its way back: landing here") << height;
    EXPECT_LT(after, MissionConfig().return_patience + 20.0) << height;
  }
}

}  // namespace
}  // namespace chase::mission
