// chase-simulator with its devices, and chase-fcu, chase-lidar and chase-camera as processes on
// them. To be run in a network namespace of its own (test/flight/in_namespace.sh).
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <functional>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/camera_image_t.hpp"
#include "chase/imu_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/status_t.hpp"
#include "chase/truth_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/udp_bus.h"
#include "common/math/rotation.h"
#include "common/mavlink/framing.h"
#include "common/mavlink/px4_mode.h"
#include "process.h"

namespace chase::testing {
namespace {

namespace mav = mavlink::mav;

/// What one stream of stamped messages looks like.
struct Stream {
  int count = 0;
  int64_t last = 0;
  bool rising = true;
  double worst_age = -1.0, least_age = 1e9;  // s
  void Add(int64_t utime, int64_t now) {
    ++count;
    rising = rising && utime > last;
    last = utime;
    worst_age = std::max(worst_age, 1e-6 * static_cast<double>(now - utime));
    least_age = std::min(least_age, 1e-6 * static_cast<double>(now - utime));
  }
};

/// Odometry (the truth) and control (to a height, or motors off); the drivers' outputs are watched.
class World {
 public:
  World()
      : bus_(bus::kDefaultUrl, ""),
        fcu(CHASE_BIN "/chase-fcu", "hover_thrust: 0.446\n"),
        lidar(CHASE_BIN "/chase-lidar", "source: udp\n"),
        camera(CHASE_BIN "/chase-camera", "source: http://127.0.0.1:8090/stream\n"),
        simulator(CHASE_BIN "/chase-simulator",
                  "scenario: " CHASE_SOURCE_DIR "/deploy/scenarios/gym.yaml\n", "--hardware") {
    bus_.SetIdentity({"control", "", bus_.Now()});
    bus_.Subscribe<imu_t>("IMU", [this](const imu_t& m) { imu.Add(m.utime, bus_.Now()); });
    bus_.Subscribe<lidar_scan_t>("LIDAR_SCAN", [this](const lidar_scan_t& m) {
      scans.Add(m.utime, bus_.Now());
      points = m.size;
    });
    bus_.Subscribe<camera_image_t>("CAMERA_IMAGE", [this](const camera_image_t& m) {
      images.Add(m.utime, bus_.Now());
      width = m.width;
    });
    Watch("FCU_STATUS", &fcu_status);
    Watch("LIDAR_STATUS", &lidar_status);
    Watch("CAMERA_STATUS", &camera_status);
    bus_.Subscribe<truth_t>("TRUTH", [this](const truth_t& m) { Feed(m); });
  }

  bool Run(
      double seconds, const std::function<bool()>& until = [] { return false; }) {
    const int64_t end = bus_.Now() + static_cast<int64_t>(1e6 * seconds);
    while (bus_.Now() < end) {
      bus_.Handle(2'000);
      if (until()) return true;
    }
    return false;
  }
  bool Flies(double seconds) {
    return Run(seconds, [&] { return fcu_status.detail.find("flying") == 0; });
  }
  int64_t now() const { return bus_.Now(); }

 private:
  void Watch(const char* channel, status_t* status) {
    bus_.Subscribe<status_t>(channel, [status](const status_t& m) { *status = m; });
  }

  void Feed(const truth_t& truth) {
    p_WB = bus::ToVector(truth.pos);
    pose_t pose{};
    pose.utime = truth.utime;
    std::copy(truth.pos, truth.pos + 3, pose.pos);
    std::copy(truth.vel, truth.vel + 3, pose.vel);
    std::copy(truth.orientation, truth.orientation + 4, pose.orientation);
    for (int i = 0; i < 9; ++i) pose.local_covariance[10 * i] = 1e-4;
    bus_.Publish("POSE", pose);
    if (!start) start = p_WB;
    const Eigen::Vector3d goal(start->x(), start->y(), height);
    const Eigen::Vector3d a = 1.5 * (goal - p_WB) - 2.0 * bus::ToVector(truth.vel);
    const Eigen::Vector3d force = a.cwiseMax(-2.0).cwiseMin(2.0) + Eigen::Vector3d(0, 0, 9.81);
    attitude_setpoint_t m{};
    m.utime = truth.utime;
    bus::Set(m.orientation, math::FromZAxisAndYaw(force, 0.0));
    m.thrust = force.norm();
    m.motors = motors ? attitude_setpoint_t::MOTORS_ON : attitude_setpoint_t::MOTORS_OFF;
    bus_.Publish("ATTITUDE_SETPOINT", m);
  }

  bus::UdpBus bus_;

 public:
  Process fcu, lidar, camera, simulator;
  Stream imu, scans, images;
  int points = 0, width = 0;
  double height = 1.5;  // m
  bool motors = true;
  status_t fcu_status{}, lidar_status{}, camera_status{};
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> start;
};

/// A ground station's command, on the autopilot's own port.
void PilotMode(mavlink::Mode mode) {
  mavlink::FrameWriter writer(255, 190);
  mav::CommandLong m;
  m.target_system = m.target_component = 1;
  m.command = static_cast<uint16_t>(mav::MavCmd::DO_SET_MODE);
  m.param1 = 1.0f, m.param2 = mode.main, m.param3 = mode.sub;
  const auto bytes = writer.Write(0, m);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(14580);
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  sendto(fd, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to);
  close(fd);
}

TEST(DriversLive, TheSimulatedVehicleFliesThroughItsDrivers) {
  World world;
  ASSERT_TRUE(world.Flies(40.0)) << world.fcu_status.detail << world.fcu.errors()
                                 << world.simulator.errors();
  world.Run(5.0);
  world.imu = world.scans = world.images = {};
  world.Run(10.0);
  EXPECT_NEAR(world.p_WB.z(), 1.5, 0.3);
  std::printf(
      "10 s: %d samples (%.1f to %.1f ms old), %d sweeps (%.1f to %.1f ms), %d images "
      "(%.1f to %.1f ms)\n",
      world.imu.count, 1e3 * world.imu.least_age, 1e3 * world.imu.worst_age, world.scans.count,
      1e3 * world.scans.least_age, 1e3 * world.scans.worst_age, world.images.count,
      1e3 * world.images.least_age, 1e3 * world.images.worst_age);
  // A busy machine makes the simulation lag, and what comes late is late, never lost.
  EXPECT_GT(world.imu.count, 1700);
  EXPECT_GE(world.scans.count, 85);
  EXPECT_GE(world.images.count, 150);
  EXPECT_TRUE(world.imu.rising && world.scans.rising && world.images.rising);
  EXPECT_GT(world.imu.least_age, -0.003) << "stamps of the future";
  EXPECT_GT(world.scans.least_age, 0.099) << "a sweep is 99.5 ms old when its last laser fires";
  // Its last packet waits for the simulation's step and for the next sweep's first packet; a stamp
  // that is one sweep off would make 0.2 s.
  EXPECT_LT(world.scans.least_age, 0.15);
  EXPECT_GT(world.images.least_age, 0.0);
  EXPECT_LT(world.images.least_age, 0.03);
  EXPECT_GT(world.points, 20000);
  EXPECT_EQ(world.width, 376);
  EXPECT_NE(world.lidar_status.detail.find(" 0 packets lost, 0 malformed"), std::string::npos)
      << world.lidar_status.detail;
  std::printf("fcu: %s\nlidar: %s\ncamera: %s\n", world.fcu_status.detail.c_str(),
              world.lidar_status.detail.c_str(), world.camera_status.detail.c_str());
}

// PX4 calls itself landed by the thrust that goes to none, and is disarmed; it is not asked to
// land.
TEST(DriversLive, ItLandsAndIsDisarmedWithoutALandingOfTheAutopilots) {
  World world;
  ASSERT_TRUE(world.Flies(40.0)) << world.fcu_status.detail;
  world.Run(5.0);
  world.height = -0.7;
  ASSERT_TRUE(world.Run(10.0, [&] { return world.p_WB.z() < world.start->z() + 0.02; }));
  world.Run(1.0);
  EXPECT_EQ(world.fcu_status.detail.find("flying"), 0u) << world.fcu_status.detail;
  world.motors = false;
  const int64_t begin = world.now();
  EXPECT_TRUE(world.Run(4.0, [&] { return world.fcu_status.detail.find("done") == 0; }));
  std::printf("motors off to disarmed: %.2f s\n", 1e-6 * static_cast<double>(world.now() - begin));
  EXPECT_NE(world.fcu_status.detail.find("mode OFFBOARD, disarmed, on ground"), std::string::npos)
      << world.fcu_status.detail;
}

TEST(DriversLive, APilotTakesOverAndTheAutopilotHolds) {
  World world;
  ASSERT_TRUE(world.Flies(40.0)) << world.fcu_status.detail;
  world.Run(5.0);
  PilotMode(mavlink::kPositionMode);
  EXPECT_TRUE(world.Run(3.0, [&] { return world.fcu_status.detail.find("pilot") == 0; }))
      << world.fcu_status.detail;
  const Eigen::Vector3d before = world.p_WB;
  world.Run(6.0);
  EXPECT_LT((world.p_WB - before).norm(), 0.5) << "POSCTL without sticks stays";
  PilotMode(mavlink::kLandMode);
  EXPECT_TRUE(world.Run(15.0, [&] {
    return world.fcu_status.detail.find("disarmed, on ground") != std::string::npos;
  })) << world.fcu_status.detail;
}

TEST(DriversLive, SilentDevicesAreNoticed) {
  World world;
  ASSERT_TRUE(world.Run(40.0,
                        [&] {
                          return world.lidar_status.state == status_t::OK &&
                                 world.camera_status.state == status_t::OK &&
                                 world.scans.count > 10;
                        }))
      << world.lidar_status.detail << "; " << world.camera_status.detail;
  world.simulator.End(SIGKILL);
  const int64_t silent = world.now();
  const auto failed = [](const status_t& s) { return s.state == status_t::FAILED; };
  ASSERT_TRUE(world.Run(5.0, [&] { return failed(world.lidar_status); }));
  std::printf("lidar: %.0f ms: %s\n", 1e-3 * static_cast<double>(world.lidar_status.utime - silent),
              world.lidar_status.detail.c_str());
  EXPECT_LT(world.lidar_status.utime - silent, 300'000);
  ASSERT_TRUE(world.Run(5.0, [&] { return failed(world.camera_status); }));
  EXPECT_LT(world.camera_status.utime - silent, 500'000);
  EXPECT_NE(world.camera_status.detail.find("check the cable"), std::string::npos);
}

}  // namespace
}  // namespace chase::testing
