// The simulator's devices against the drivers that read them, in one process.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "../fcu/firing_order.h"
#include "common/bus/host_clock.h"
#include "common/math/rotation.h"
#include "common/world/scenario.h"
#include "services/camera/capture_clock.h"
#include "services/camera/frame_source.h"
#include "services/camera/grabber.h"
#include "services/lidar/gps_clock.h"
#include "services/lidar/sweep_assembler.h"
#include "services/simulator/estimator.h"
#include "services/simulator/mjpeg_server.h"
#include "services/simulator/position_packet.h"
#include "services/simulator/simulator.h"

namespace chase {
namespace {

constexpr int kPort = 38090;

simulator::Output Step(simulator::Simulator* simulator, long tick) {
  simulator::AttitudeSetpoint up;
  up.orientation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d(1, 1, 1).normalized()));
  up.thrust = 11.0;
  up.body_rate = {0.3, -0.2, 0.5};
  simulator->SetSetpoint(up, 0.005 * static_cast<double>(tick));
  return simulator->Advance(0.005 * static_cast<double>(tick));
}

/// In flight, turning: what the driver makes of the packets is what was measured.
TEST(Drivers, CloudsFromPacketsAreTheSensorsOwn) {
  simulator::SimulatorConfig config;
  config.lidar.packets = true;
  config.camera.rate = 0.0;
  const auto scenario =
      world::LoadScenario(std::string(CHASE_SOURCE_DIR) + "/deploy/scenarios/gym.yaml");
  simulator::Simulator simulator(scenario, config);
  lidar::SweepAssembler assembler(lidar::LidarConfig{});
  std::vector<simulator::Sweep> direct;
  std::vector<lidar::Sweep> decoded;
  for (long tick = 0; tick < 160; ++tick) {
    simulator::Output output = Step(&simulator, tick);
    if (output.sweep) direct.push_back(std::move(*output.sweep));
    for (simulator::DataPacket& packet : output.packets) {
      packet.SetStamp(3'599'700'000 + std::llround(1e6 * packet.start));  // wraps on its way
      ASSERT_LT(lidar::PacketStamp(packet.bytes.data()), 3'600'000'000u) << "the hour is over";
      for (auto& sweep : assembler.Add(packet.bytes.data(), packet.bytes.size()))
        decoded.push_back(std::move(sweep));
    }
  }
  ASSERT_GE(decoded.size(), 6u);
  EXPECT_EQ(assembler.lost(), 0);
  EXPECT_EQ(assembler.malformed(), 0);
  double worst = 0.0, worst_time = 0.0;
  for (std::size_t k = 0; k < decoded.size(); ++k) {
    const simulator::Sweep& a = direct[k];
    const auto& b = decoded[k].points;
    ASSERT_EQ(a.x.size(), b.size()) << "sweep " << k;
    ASSERT_GT(b.size(), 20000u);
    const std::vector<std::size_t> order = testing::FiringOrder(a);
    for (std::size_t n = 0; n < b.size(); ++n) {
      const std::size_t i = order[n];
      const Eigen::Vector3d p(a.x[i], a.y[i], a.z[i]), q(b[n].x, b[n].y, b[n].z);
      worst = std::max(worst, (p - q).norm());
      worst_time = std::max(worst_time, std::abs(static_cast<double>(a.t[i]) - b[n].t));
      ASSERT_EQ(a.ring[i], b[n].ring);
      ASSERT_EQ(a.intensity[i], b[n].intensity);
    }
  }
  std::printf("worst point %.6f m, worst firing time %.2f us\n", worst, 1e6 * worst_time);
  EXPECT_LT(worst, 1e-3) << "half of the packet's 2 mm";
  EXPECT_LT(worst_time, 2e-6) << "stamps are whole microseconds";
}

/// 2016-01-21 08:18:02.34 UTC, as in a recording of a true sensor.
TEST(Drivers, PositionPacketsAreASensorsOwn) {
  constexpr int64_t kUtc = 1'453'364'282'340'000;
  const auto locked = simulator::PositionPacket(kUtc, true);
  EXPECT_EQ(locked[198] | locked[199] << 8 | locked[200] << 16 | locked[201] << 24,
            (18 * 60 + 2) * 1'000'000 + 340'000);
  EXPECT_STREQ(reinterpret_cast<const char*>(&locked[206]),
               "$GPRMC,081802.00,A,0000.0000000,N,00000.0000000,E,0.0,0.0,210116,0.0,E,A*33\r\n");
  lidar::GpsClock clock;
  const auto own = simulator::PositionPacket(kUtc, false);
  clock.Hear(own.data(), own.size(), kUtc);
  EXPECT_EQ(clock.Problem(kUtc), "the sensor has no pulse per second");
  clock.Hear(locked.data(), locked.size(), kUtc);
  EXPECT_EQ(clock.Utc(kUtc % 3'600'000'000, kUtc + 3'000), kUtc);
}

TEST(Drivers, LasersOffTheCentreSeeWhatTheyWouldSee) {
  const auto scenario = world::ParseScenario(
      "name: test\ntarget: {waypoints: [[200, 200], [210, 200]], carrier_size: [0, 0, 0]}\n"
      "world: {ground: {height: 0}}\n",
      "test");
  const simulator::Scene scene(scenario);
  simulator::LidarConfig config;
  config.noise = config.dropout = 0.0;
  config.packets = true;
  simulator::Lidar lidar(config, world::Rig{}, 1);
  for (int tick = 0; tick < 20; ++tick)
    lidar.Advance({{0.005 * tick, {0, 0, 2.0}, Eigen::Quaterniond::Identity()},
                   {0.005 * (tick + 1), {0, 0, 2.0}, Eigen::Quaterniond::Identity()}},
                  scene);
  const auto sweep = lidar.Take();
  ASSERT_TRUE(sweep);
  ASSERT_FALSE(sweep->z.empty());
  // 2 mm of range are a millimetre of height at most.
  for (std::size_t i = 0; i < sweep->z.size(); ++i) ASSERT_NEAR(sweep->z[i], -2.1, 1.1e-3);
}

simulator::Image Grey(int value) {
  simulator::Image image;
  image.width = 64, image.height = 48;
  image.rgb.assign(64 * 48 * 3, static_cast<uint8_t>(value));
  return image;
}

std::optional<camera::Grabber::Grabbed> Wait(camera::Grabber* grabber,
                                             simulator::MjpegServer* server) {
  for (int i = 0; i < 600; ++i) {
    server->Tick();
    if (auto taken = grabber->Take()) return taken;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return std::nullopt;
}

TEST(Drivers, AStreamedFrameCarriesItsCaptureTime) {
  simulator::MjpegServer server(kPort, 95);
  camera::Grabber grabber(camera::OpenFrameSource({"http://127.0.0.1:38090/stream"}));
  for (int k = 1; k <= 5; ++k) {
    const int64_t captured = bus::WallMicroseconds() - 30'000 - k;
    std::optional<camera::Grabber::Grabbed> taken;
    for (int attempt = 0; attempt < 20 && !taken; ++attempt) {  // until it has connected
      server.Send(Grey(40 * k), captured);
      for (int i = 0; i < 20 && !taken; ++i) {
        server.Tick();
        taken = grabber.Take();
        if (!taken) std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    }
    ASSERT_TRUE(taken) << k << grabber.Problem();
    EXPECT_EQ(taken->frame.clock, camera::StampClock::kWall);
    EXPECT_NEAR(static_cast<double>(taken->frame.stamp - captured), 0.0, 1.0);
    EXPECT_NEAR(taken->frame.bgr.at<cv::Vec3b>(20, 30)[0], 40 * k, 3);
  }
}

TEST(Drivers, ACameraThatIsUnpluggedIsFoundAgain) {
  auto server = std::make_unique<simulator::MjpegServer>(kPort, 95);
  camera::Grabber grabber(camera::OpenFrameSource({"http://127.0.0.1:38090/stream"}));
  const auto see = [&] {
    for (int i = 0; i < 100; ++i) {
      server->Send(Grey(100), bus::WallMicroseconds());
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      if (grabber.Take()) return true;
    }
    return false;
  };
  ASSERT_TRUE(see());
  server.reset();
  for (int i = 0; i < 100 && grabber.Problem().empty(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_NE(grabber.Problem(), "");
  server = std::make_unique<simulator::MjpegServer>(kPort, 95);
  EXPECT_TRUE(see());
}

TEST(Drivers, OfFramesThatNobodyFetchedTheNewestIsKept) {
  simulator::MjpegServer server(kPort, 95);
  camera::Grabber grabber(camera::OpenFrameSource({"http://127.0.0.1:38090/stream"}));
  server.Send(Grey(10), bus::WallMicroseconds());
  for (int i = 0; i < 200 && !Wait(&grabber, &server); ++i)
    server.Send(Grey(10), bus::WallMicroseconds());
  const long before = grabber.dropped();
  for (int k = 1; k <= 5; ++k) {
    server.Send(Grey(40 * k), bus::WallMicroseconds());
    for (int i = 0; i < 10; ++i) {
      server.Tick();
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  const auto taken = grabber.Take();
  ASSERT_TRUE(taken);
  EXPECT_NEAR(taken->frame.bgr.at<cv::Vec3b>(20, 30)[0], 200, 3);
  EXPECT_EQ(grabber.dropped() - before, 4);
}

/// Vision's frame is turned and shifted against the simulator's, and drifts; its velocity is told.
TEST(Drivers, TheAutopilotLivesInVisionsFrame) {
  simulator::Estimator estimator;
  simulator::BodyState body;
  const double yaw = 0.7, drift = 0.1;
  const Eigen::Vector3d p_WO(3.0, -2.0, 0.5), gravity(0.0, 0.0, 9.81);
  const Eigen::Quaterniond R_WO(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  const auto see = [&](int64_t utime, double turned, int resets) {
    const Eigen::Quaterniond R_OW = math::FromYaw(-turned - yaw);
    estimator.Correct({utime, R_OW * (body.p - p_WO), R_OW * body.v, 0.4 - yaw - turned, resets});
  };
  const auto turn = [&] { return estimator.InWorld(Eigen::Quaterniond::Identity()); };
  body.q = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ());
  body.v = {2.0, 4.0, 0.0};
  for (int k = 0; k < 200; ++k) {
    body.p = {0.01 * k, 0.02 * k, 1.0};
    estimator.Predict(5'000 * k, body, gravity);
    if (k % 5 == 0) see(5'000 * k, 0.0, 1);
  }
  const simulator::Px4Body known = estimator.Body(body);
  EXPECT_LT((known.p_WB - R_WO.conjugate() * (body.p - p_WO)).norm(), 1e-9);
  EXPECT_LT((known.v_WB - R_WO.conjugate() * body.v).norm(), 1e-9);
  EXPECT_LT(turn().angularDistance(R_WO), 1e-9);
  see(995'000, drift, 1);  // one pose pulls a little: 20 ms of 0.5 s
  EXPECT_NEAR(turn().angularDistance(R_WO), 0.04 * drift, 1e-6);
  see(995'000, drift, 2);  // a reset is taken over at once
  EXPECT_NEAR(turn().angularDistance(R_WO), drift, 1e-6);
  EXPECT_NE(estimator.Body(body).resets, known.resets);
}

/// Without vision it goes by what the accelerometer is off by, for 5 s.
TEST(Drivers, TheAutopilotsVelocityIsWorthlessAfterVisionEnds) {
  simulator::Estimator estimator;
  const simulator::BodyState body;
  const Eigen::Vector3d accel(0.05, 0.0, 9.9);
  EXPECT_FALSE(estimator.Body(body).knows_velocity);
  for (int k = 0; k <= 2000; ++k) {
    estimator.Predict(5'000 * k, body, accel);
    if (k <= 800) estimator.Correct({5'000 * k, body.p, body.v, 0.0, 0});
    EXPECT_EQ(estimator.Body(body).knows_velocity, k <= 1800) << k;
  }
  const Eigen::Vector3d off = estimator.Body(body).v_WB;
  EXPECT_NEAR(off.x(), 6.0 * 0.05 + 0.5 * 0.05, 0.01);  // and what vision had not taken away
  EXPECT_EQ(off.z(), 0.0);
}

TEST(CaptureClock, AStampOfThisHostIsBelievedWhileItIsPossible) {
  camera::CaptureClock clock;
  EXPECT_EQ(clock.HostTime(1'000'000, true, 1'040'000), 1'000'000);
  EXPECT_TRUE(clock.believed());
  // Five seconds off: another machine's clock. The smallest delay counts as none.
  camera::CaptureClock other;
  int64_t host = 0;
  for (int k = 0; k < 200; ++k) {
    const int64_t captured = 50'000 * k, delay = 20'000 + 1'000 * (k % 7);
    host = other.HostTime(captured - 5'000'000, true, captured + delay) - captured;
  }
  EXPECT_FALSE(other.believed());
  EXPECT_NEAR(static_cast<double>(host), 20'000.0, 1'000.0);
}

}  // namespace
}  // namespace chase
