#include "services/mapping/mapping_node.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>
#include <vector>

#include "chase/map_t.hpp"
#include "chase/obstacles_t.hpp"
#include "common/bus/lockstep.h"
#include "mapping_world.h"

namespace chase::mapping {
namespace {

constexpr int64_t kStart = 1'700'000'000'000'000;  // microseconds

class Silent : public bus::Node {};

/// The node on an in-memory bus, with a hand on both ends.
class Bench {
 public:
  explicit Bench(const MappingConfig& config = {}) {
    lockstep_->Add("test", 0, [this](bus::Bus& bus) {
      bus_ = &bus;
      bus.Subscribe<obstacles_t>("OBSTACLES", [this](const obstacles_t& m) { lists.push_back(m); });
      bus.Subscribe<map_t>("MAP", [this](const map_t& m) { maps.push_back(m); });
      return std::make_unique<Silent>();
    });
    lockstep_->Add("mapping", 0, [&](bus::Bus& bus) {
      auto node = std::make_unique<MappingNode>(bus, config);
      node_ = node.get();
      return node;
    });
  }

  scan_registered_t Scan(int64_t utime, const Eigen::Vector3d& at = {4.0, 4.0, 1.3}) {
    const Sweep sweep = testing::Scan(testing::Gym(), at, 0.0, {}, &random_);
    scan_registered_t m{};
    m.utime = utime;
    for (int i = 0; i < 3; ++i) m.pos[i] = sweep.origin[i];
    m.orientation[0] = 1.0;
    m.health = pose_t::HEALTH_OK;
    for (const auto& p : sweep.points) {
      m.x.push_back(p.x());
      m.y.push_back(p.y());
      m.z.push_back(p.z());
    }
    return Sized(m);
  }
  static scan_registered_t Sized(scan_registered_t m) {
    m.size = static_cast<int32_t>(m.x.size());
    m.intensity.assign(m.x.size(), 0);
    m.ring.assign(m.x.size(), 0);
    return m;
  }
  void Send(const scan_registered_t& m) {
    bus_->Publish("SCAN_REGISTERED", m);
    lockstep_->RunUntil(std::max(lockstep_->now(), m.utime));
  }
  void Send(const target_t& m) { bus_->Publish("TARGET", m); }
  void End() { lockstep_.reset(); }
  const MappingNode& node() const { return *node_; }

  std::vector<obstacles_t> lists;
  std::vector<map_t> maps;

 private:
  std::unique_ptr<bus::Lockstep> lockstep_ = std::make_unique<bus::Lockstep>(kStart);
  bus::Bus* bus_ = nullptr;
  MappingNode* node_ = nullptr;
  std::mt19937 random_{1};
};

TEST(MappingNodeTest, EverySweepIsAnsweredAndTheMapOnceASecond) {
  Bench bench;
  for (int i = 1; i <= 21; ++i) bench.Send(bench.Scan(kStart + i * 100'000));
  ASSERT_EQ(bench.lists.size(), 21u);
  ASSERT_EQ(bench.maps.size(), 3u);
  EXPECT_EQ(bench.lists[4].utime, kStart + 500'000);
  EXPECT_EQ(bench.lists[4].n_obstacles, static_cast<int32_t>(bench.lists[4].obstacles.size()));
  int statics = 0, ground = 0;
  for (const auto& o : bench.lists[4].obstacles) {
    statics += o.kind == obstacle_t::STATIC;
    ground += o.kind == obstacle_t::GROUND;
    EXPECT_EQ(o.center.n_coefficients, 3);
    EXPECT_EQ(o.center.utime, bench.lists[4].utime);
  }
  EXPECT_GT(statics, 10);
  EXPECT_GT(ground, 0);
  EXPECT_EQ(statics + ground, bench.lists[4].n_obstacles);
  EXPECT_EQ(bench.maps[1].format, "bt");
  EXPECT_GT(bench.maps[1].n_occupied, 500);
  const std::string head(bench.maps[1].data.begin(), bench.maps[1].data.begin() + 22);
  EXPECT_EQ(head, "# Octomap OcTree binar");
  EXPECT_EQ(bench.node().Report().state, bus::NodeReport::State::kOk);
}

TEST(MappingNodeTest, LostSweepsAreNotMapped) {
  Bench bench;
  auto m = bench.Scan(kStart + 100'000);
  m.health = pose_t::HEALTH_LOST;
  bench.Send(m);
  EXPECT_TRUE(bench.lists.empty());
  EXPECT_NE(bench.node().Report().state, bus::NodeReport::State::kOk);
  bench.Send(bench.Scan(kStart + 200'000));
  EXPECT_EQ(bench.lists.size(), 1u);
}

TEST(MappingNodeTest, SweepsFromThePastAreRefused) {
  Bench bench;
  bench.Send(bench.Scan(kStart + 200'000));
  bench.Send(bench.Scan(kStart + 200'000));
  bench.Send(bench.Scan(kStart + 100'000));
  EXPECT_EQ(bench.lists.size(), 1u);
}

TEST(MappingNodeTest, AClockThatIsSetBackCostsOneSweep) {
  Bench bench;
  for (int i = 0; i < 5; ++i) bench.Send(bench.Scan(kStart + 100'000 * i));
  for (int i = 0; i < 5; ++i) bench.Send(bench.Scan(kStart - 5'000'000 + 100'000 * i));
  ASSERT_EQ(bench.lists.size(), 9u);
  EXPECT_EQ(bench.lists[5].utime, kStart - 4'900'000);
}

TEST(MappingNodeTest, HostileCloudsAreSurvived) {
  Bench bench;
  const float nan = std::nanf(""), inf = INFINITY;
  scan_registered_t m{};
  m.orientation[0] = 1.0;
  m.utime = kStart + 100'000;
  bench.Send(Bench::Sized(m));  // empty
  m.utime += 100'000;
  m.x = {nan, 1.0f, 1e30f, 0.0f};
  m.y = {0.0f, inf, 1e30f, 0.0f};
  m.z = {0.0f, 0.0f, -1e30f, nan};
  bench.Send(Bench::Sized(m));
  m.utime += 100'000;
  m.pos[0] = 9e6;
  bench.Send(Bench::Sized(m));
  bench.Send(bench.Scan(kStart + 400'000));
  ASSERT_EQ(bench.lists.size(), 4u);
  EXPECT_GT(bench.lists.back().n_obstacles, 10);
}

TEST(MappingNodeTest, TheTargetIsLeftOut) {
  Bench with, without;
  target_t target{};
  target.utime = kStart + 50'000;
  target.state = target_t::TRACKING;  // claims that the pillar at (6, 3.4) is the target
  target.mean[0] = 6.0;
  target.mean[1] = 3.4;
  target.mean[2] = 1.5;
  target.radius = 0.3;
  target.height = 3.0;
  with.Send(target);
  for (auto* bench : {&with, &without})
    for (int i = 1; i <= 5; ++i) bench->Send(bench->Scan(kStart + i * 100'000));
  EXPECT_LT(with.lists.back().n_obstacles, without.lists.back().n_obstacles);
}

TEST(MappingNodeTest, TheMapIsSavedAtTheEnd) {
  const std::string file = ::testing::TempDir() + "/mapping_node_test.bt";
  MappingConfig config;
  config.save_map = file;
  Bench bench(config);
  for (int i = 1; i <= 3; ++i) bench.Send(bench.Scan(kStart + i * 100'000));
  bench.End();
  EXPECT_GT(std::filesystem::file_size(file), 1000u);
  std::filesystem::remove(file);
  config.save_map = "/nowhere/at/all.bt";
  EXPECT_THROW(Bench{config}, std::runtime_error);
}

}  // namespace
}  // namespace chase::mapping
