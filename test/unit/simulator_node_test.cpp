#include "services/simulator/simulator_node.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <fstream>
#include <iterator>
#include <map>
#include <numeric>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/camera_image_t.hpp"
#include "chase/event_t.hpp"
#include "chase/imu_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "chase/obstacles_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/scenario_t.hpp"
#include "chase/target_t.hpp"
#include "chase/truth_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/lockstep.h"

namespace chase::simulator {
namespace {

constexpr int64_t kStart = 1700000000000000;

/// Every message of a run, as bytes by channel.
using Record = std::map<std::string, std::vector<std::pair<int64_t, bus::Bus::Bytes>>>;

Record Simulated(const SimulatorConfig& config, int64_t duration_us) {
  Record record;
  bus::Lockstep lockstep(kStart);
  lockstep.SetTap([&](int64_t utime, const std::string& channel, const bus::Bus::Bytes& bytes) {
    record[channel].emplace_back(utime, bytes);
  });
  lockstep.Add("simulator", 0,
               [&](bus::Bus& bus) { return std::make_unique<SimulatorNode>(bus, config); });
  lockstep.RunUntil(kStart + duration_us);
  record.erase("SIMULATOR_STATUS");  // says how long things took
  return record;
}

SimulatorConfig Config(const std::string& scenario = "gym") {
  SimulatorConfig config;
  config.scenario = std::string(CHASE_SOURCE_DIR) + "/deploy/scenarios/" + scenario + ".yaml";
  return config;
}

/// The gym with mission time zero at power-on, and a fault at half a second if it has a name.
SimulatorConfig AtOnce(const std::string& fault = "") {
  SimulatorConfig config = Config();
  std::ifstream in(config.scenario);
  std::string text((std::istreambuf_iterator<char>(in)), {});
  text.replace(text.find("settle_s: 8"), 11, "settle_s: 0");
  config.scenario = ::testing::TempDir() + "chase_at_once.yaml";
  std::ofstream(config.scenario) << text;
  if (!fault.empty()) config.faults = {world::Settled({fault, 0.5}, 60.0, 1, 0)};
  return config;
}

/// The gym, fed the truth.
SimulatorConfig TruthConfig() {
  std::ifstream in(Config().scenario);
  std::string text((std::istreambuf_iterator<char>(in)), {});
  const std::string raw = "mode: raw";
  text.replace(text.find(raw), raw.size(), "mode: truth");
  SimulatorConfig config;
  config.scenario = ::testing::TempDir() + "chase_truth.yaml";
  std::ofstream(config.scenario) << text;
  return config;
}

template <class T>
T Message(const Record& record, const std::string& channel, std::size_t i) {
  const auto& bytes = record.at(channel).at(i).second;
  T message;
  EXPECT_EQ(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())),
            static_cast<int>(bytes.size()));
  EXPECT_EQ(bus::Problem(message), "") << channel;
  return message;
}

TEST(SimulatorNode, PublishesEveryChannelAtItsRate) {
  const Record record = Simulated(Config(), 2000000);
  EXPECT_EQ(record.at("IMU").size(), 401u);
  EXPECT_EQ(record.at("TRUTH").size(), 201u);
  EXPECT_EQ(record.at("CAMERA_IMAGE").size(), 41u);
  EXPECT_EQ(record.at("LIDAR_SCAN").size(), 20u);
  EXPECT_EQ(record.at("SCENARIO").size(), 3u);
  EXPECT_EQ(record.at("FCU_STATUS").size(), 3u);
  EXPECT_EQ(record.size(), 6u);  // nothing of the truth feed
  for (std::size_t i = 0; i < 20; ++i) {
    const auto scan = Message<lidar_scan_t>(record, "LIDAR_SCAN", i);
    EXPECT_EQ(scan.utime, kStart + static_cast<int64_t>(i) * 100000);
    EXPECT_EQ(scan.seq, static_cast<int32_t>(i));
    EXPECT_GE(record.at("LIDAR_SCAN")[i].first, scan.utime + 99533);
  }
  const auto image = Message<camera_image_t>(record, "CAMERA_IMAGE", 3);
  EXPECT_EQ(image.utime, kStart + 150000);
  EXPECT_EQ(image.size, 376 * 240 * 3);
}

TEST(SimulatorNode, TheScenarioExplainsTheLog) {
  const Record record = Simulated(Config(), 1000);
  const auto message = Message<scenario_t>(record, "SCENARIO", 0);
  EXPECT_EQ(message.start_utime, kStart + 8000000);
  EXPECT_EQ(message.name, "gym");
  EXPECT_EQ(world::ParseScenario(message.yaml, "log").world.cylinders.size(), 7u);
}

TEST(SimulatorNode, SameSeedSameBytes) {
  const SimulatorConfig config = Config();
  EXPECT_EQ(Simulated(config, 1500000), Simulated(config, 1500000));
}

TEST(SimulatorNode, AnotherSeedIsAnotherFlight) {
  SimulatorConfig other = Config();
  other.seed = 2;
  const Record a = Simulated(Config(), 200000), b = Simulated(other, 200000);
  EXPECT_NE(a.at("IMU"), b.at("IMU"));
  EXPECT_NE(a.at("LIDAR_SCAN"), b.at("LIDAR_SCAN"));
  EXPECT_NE(a.at("CAMERA_IMAGE"), b.at("CAMERA_IMAGE"));
}

TEST(SensorFaults, WithoutALengthAFaultLastsAsLongAsItsKind) {
  const std::vector<world::FaultSpec> gap = {{"lidar-gap", 0.5}};
  SensorFaults faults(gap);
  EXPECT_EQ(faults.Advance(0.6).size(), 1u);
  EXPECT_TRUE(faults.LidarSilent());
  EXPECT_EQ(faults.Advance(1.6).size(), 1u);
  EXPECT_FALSE(faults.LidarSilent());
}

TEST(SimulatorNode, ALidarFaultTakesSweepsAndChangesNothingElse) {
  SimulatorConfig config = AtOnce();
  const Record whole = Simulated(config, 2000000);
  config.faults = {world::Settled({"lidar-gap", 0.5}, 60.0, 1, 0),
                   world::Settled({"lidar-dead", 1.75}, 60.0, 1, 1)};
  Record struck = Simulated(config, 2000000);
  std::vector<int64_t> expected;
  for (const auto& [utime, bytes] : whole.at("LIDAR_SCAN"))
    if (utime < kStart + 500000 || (utime >= kStart + 1500000 && utime < kStart + 1750000))
      expected.push_back(utime);
  ASSERT_EQ(struck.at("LIDAR_SCAN").size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(struck.at("LIDAR_SCAN")[i].first, expected[i]);
    EXPECT_EQ(Message<lidar_scan_t>(struck, "LIDAR_SCAN", i).seq, static_cast<int32_t>(i));
  }
  const std::vector<std::pair<int64_t, std::string>> events = {
      {500000, "lidar-gap"}, {1500000, "lidar-gap"}, {1750000, "lidar-dead"}};
  ASSERT_EQ(struck.at("FAULT").size(), events.size());
  for (std::size_t i = 0; i < events.size(); ++i) {
    const auto event = Message<event_t>(struck, "FAULT", i);
    EXPECT_EQ(event.utime, kStart + events[i].first);
    EXPECT_EQ(event.name, events[i].second);
    EXPECT_EQ(event.phase, i == 1 ? int{event_t::ENDS} : int{event_t::BEGINS});
  }
  for (const char* channel : {"IMU", "CAMERA_IMAGE", "TRUTH", "SCENARIO"})
    EXPECT_EQ(struck.at(channel), whole.at(channel)) << channel;
}

/// The first frame, sweep or sample sent from half a second on, without and with the fault. What
/// was sent before must be the same.
template <class T>
std::pair<T, T> Struck(const std::string& fault, const std::string& channel) {
  const Record whole = Simulated(AtOnce(), 1000000), struck = Simulated(AtOnce(fault), 1000000);
  EXPECT_EQ(struck.at("FAULT").size(), 1u);
  std::size_t i = 0;
  for (; whole.at(channel)[i].first < kStart + 500000; ++i)
    EXPECT_EQ(whole.at(channel)[i], struck.at(channel)[i]);
  return {Message<T>(whole, channel, i), Message<T>(struck, channel, i)};
}

TEST(SimulatorNode, ABlackoutIsBlack) {
  const auto [before, after] = Struck<camera_image_t>("camera-blackout", "CAMERA_IMAGE");
  EXPECT_EQ(after.data, std::vector<uint8_t>(before.data.size(), 0));
}

TEST(SimulatorNode, AnExposureJumpIsTwoStopsBrighter) {
  const auto [before, after] = Struck<camera_image_t>("exposure-jump", "CAMERA_IMAGE");
  for (std::size_t i = 0; i < before.data.size(); ++i)
    ASSERT_EQ(int{after.data[i]}, std::min(255, 4 * before.data[i])) << "byte " << i;
}

TEST(SimulatorNode, BlurTakesTheContrastAlongTheRowsAndKeepsTheLight) {
  const auto [before, after] = Struck<camera_image_t>("camera-blur", "CAMERA_IMAGE");
  const auto change = [](const camera_image_t& image) {
    double sum = 0.0;
    for (std::size_t i = 3; i < image.data.size(); ++i)
      sum += std::abs(int{image.data[i]} - int{image.data[i - 3]});
    return sum;
  };
  EXPECT_LT(change(after), 0.4 * change(before));
  const auto light = [](const camera_image_t& image) {
    return std::accumulate(image.data.begin(), image.data.end(), 0.0) / image.size;
  };
  EXPECT_NEAR(light(after), light(before), 3.0);
}

TEST(SimulatorNode, AnImuBiasIsAStep) {
  const auto [before, after] = Struck<imu_t>("imu-bias", "IMU");
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(after.accel[i] - before.accel[i], 0.25, 1e-12);
    EXPECT_NEAR(after.gyro[i] - before.gyro[i], 0.015, 1e-12);
  }
}

TEST(SimulatorNode, ImuSpikesAreRareAndOfFullScale) {
  const Record whole = Simulated(AtOnce(), 2500000);
  const Record struck = Simulated(AtOnce("imu-spikes"), 2500000);
  int spikes = 0;
  for (std::size_t i = 0; i < whole.at("IMU").size(); ++i) {
    if (whole.at("IMU")[i] == struck.at("IMU")[i]) continue;
    ++spikes;
    EXPECT_NEAR(bus::ToVector(Message<imu_t>(struck, "IMU", i).accel).cwiseAbs().maxCoeff(), 157.0,
                0.1);
  }
  EXPECT_NEAR(spikes, 8, 7) << "2 % of 400";
  EXPECT_EQ(struck, Simulated(AtOnce("imu-spikes"), 2500000));
}

TEST(SimulatorNode, TheLidarsClockStepsByASecond) {
  const auto [ahead, forward] = Struck<lidar_scan_t>("clock-forward", "LIDAR_SCAN");
  EXPECT_EQ(forward.utime - ahead.utime, 1000000);
  const auto [behind, back] = Struck<lidar_scan_t>("clock-back", "LIDAR_SCAN");
  EXPECT_EQ(back.utime - behind.utime, -1000000);
}

/// Pixels of the target's colour, which nothing else in the gym has.
int Orange(const camera_image_t& image) {
  int count = 0;
  for (std::size_t i = 0; i + 2 < image.data.size(); i += 3)
    count += image.data[i] > 2 * image.data[i + 2] + 60;
  return count;
}

TEST(SimulatorNode, AHiddenTargetIsNotInTheFrameNorInTheTruthsView) {
  const auto [before, after] = Struck<camera_image_t>("hidden-4s", "CAMERA_IMAGE");
  EXPECT_GT(Orange(before), 20);
  EXPECT_EQ(Orange(after), 0);
  EXPECT_EQ(
      Message<truth_t>(Simulated(AtOnce("hidden-for-good"), 1000000), "TRUTH", 90).visible_share,
      0.0);
}

TEST(SimulatorNode, ADecoyHasTheTargetsColourAndLeavesTheTruthAlone) {
  const Record whole = Simulated(AtOnce(), 1000000), decoy = Simulated(AtOnce("decoy"), 1000000);
  EXPECT_EQ(decoy.at("TRUTH"), whole.at("TRUTH"));
  SimulatorConfig config = AtOnce("decoy");  // stands behind the target, seen from the start
  config.faults.push_back(world::Settled({"hidden-4s", 0.5}, 60.0, 1, 1));
  const Record alone = Simulated(config, 1000000);
  EXPECT_GT(Orange(Message<camera_image_t>(alone, "CAMERA_IMAGE", 15)), 20);
  EXPECT_EQ(Message<truth_t>(alone, "TRUTH", 90).visible_share, 0.0);
}

/// The truth after a second of asking for one and a half times the weight.
truth_t AfterLift(int8_t motors, const SimulatorConfig& config) {
  class Lifter : public bus::Node {
   public:
    Lifter(bus::Bus& bus, int8_t motors) : bus_(bus), motors_(motors) {}
    int64_t TickPeriod() const override { return 5000; }
    void Tick(int64_t utime) override {
      attitude_setpoint_t m{};
      m.utime = utime;
      m.orientation[0] = 1.0;
      m.thrust = 15.0;
      m.motors = motors_;
      bus_.Publish("ATTITUDE_SETPOINT", m);
    }

   private:
    bus::Bus& bus_;
    int8_t motors_;
  };
  bus::Lockstep lockstep(kStart);
  truth_t last{};
  lockstep.SetTap([&](int64_t, const std::string& channel, const bus::Bus::Bytes& bytes) {
    truth_t truth;
    if (channel != "TRUTH") return;
    truth.decode(bytes.data(), 0, static_cast<int>(bytes.size()));
    last = truth;
  });
  lockstep.Add("simulator", 0,
               [&](bus::Bus& bus) { return std::make_unique<SimulatorNode>(bus, config); });
  lockstep.Add("control", 1000,
               [&](bus::Bus& bus) { return std::make_unique<Lifter>(bus, motors); });
  lockstep.RunUntil(kStart + 1000000);
  return last;
}

TEST(SimulatorNode, MotorsThatAreOffGiveNoThrust) {
  EXPECT_GT(AfterLift(attitude_setpoint_t::MOTORS_ON, Config()).pos[2], 1.0);
  EXPECT_LT(AfterLift(attitude_setpoint_t::MOTORS_OFF, Config()).pos[2], 0.2);
}

TEST(SimulatorNode, AGustPushesAndAWeakMotorCostsHeight) {
  const auto lifted = [](const std::string& fault) {
    return AfterLift(attitude_setpoint_t::MOTORS_ON, AtOnce(fault));
  };
  const truth_t whole = lifted(""), gust = lifted("gust"), motor = lifted("motor-80");
  // Drag of 0.25 1/s against 8 m/s of wind for half a second.
  EXPECT_NEAR(std::hypot(gust.vel[0] - whole.vel[0], gust.vel[1] - whole.vel[1]), 0.94, 0.15);
  // A twentieth of the thrust of 15 m/s^2, for half a second.
  EXPECT_NEAR(whole.pos[2] - motor.pos[2], 0.09, 0.04);
}

TEST(SimulatorNode, MissingOrBrokenScenarioIsRefusedAtTheStart) {
  SimulatorConfig config;
  config.scenario = "/nowhere.yaml";
  bus::Lockstep lockstep(kStart);
  const auto make = [&](bus::Bus& bus) { return std::make_unique<SimulatorNode>(bus, config); };
  EXPECT_THROW(lockstep.Add("simulator", 0, make), std::runtime_error);
  config.scenario = ::testing::TempDir() + "chase_broken.yaml";
  std::ofstream(config.scenario) << "name: x\nworlds: {}\n";
  EXPECT_THROW(lockstep.Add("simulator", 0, make), std::runtime_error);
}

TEST(TruthFeed, StandsInForOdometryPerceptionAndMapping) {
  const Record record = Simulated(TruthConfig(), 1000000);
  EXPECT_EQ(record.at("POSE").size(), 201u);
  EXPECT_EQ(record.at("TARGET").size(), 21u);
  EXPECT_EQ(record.at("OBSTACLES").size(), 11u);
  const auto pose = Message<pose_t>(record, "POSE", 100);
  const auto truth = Message<truth_t>(record, "TRUTH", 50);
  EXPECT_EQ(pose.utime, truth.utime);
  EXPECT_EQ(bus::ToVector(pose.pos), bus::ToVector(truth.pos));
  EXPECT_EQ(pose.health, int{pose_t::HEALTH_OK});
  const auto target = Message<target_t>(record, "TARGET", 5);
  EXPECT_EQ(bus::ToVector(target.mean), bus::ToVector(truth.target_pos));
  EXPECT_EQ(target.state, int{target_t::TRACKING});
  EXPECT_GT(target.box_px[2] * target.box_px[3], 100.0);
  EXPECT_EQ(Message<obstacles_t>(record, "OBSTACLES", 3).n_obstacles, 11);
}

TEST(TruthFeed, ShapesEncloseTheirSolids) {
  world::Random random(4);
  for (const auto kind :
       {world::Solid::Kind::kBox, world::Solid::Kind::kCylinder, world::Solid::Kind::kEllipsoid}) {
    world::Solid solid;
    solid.kind = kind;
    solid.half_size = {0.4, kind == world::Solid::Kind::kBox ? 1.3 : 0.4, 1.7};
    solid.yaw = 0.7;
    const Eigen::Matrix3d R = EnclosingShape(solid);
    double most = 0.0;
    for (int i = 0; i < 20000; ++i) {
      Eigen::Vector3d x(random.Uniform(-2, 2), random.Uniform(-2, 2), random.Uniform(-2, 2));
      if (world::SignedDistance(solid, x) <= 0.0) most = std::max(most, x.dot(R * x));
    }
    EXPECT_LE(most, 1.0 + 1e-9);
    EXPECT_GT(most, 0.8);
  }
}

}  // namespace
}  // namespace chase::simulator
