// chase-fcu as a process, on UDP and on a serial line (a pseudo-terminal), against the stand-in.
// To be run in a network namespace of its own (test/flight/in_namespace.sh).
#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <thread>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/command_t.hpp"
#include "chase/imu_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/status_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/udp_bus.h"
#include "common/math/rotation.h"
#include "process.h"
#include "stand_in.h"

namespace chase::fcu::testing {
namespace {

constexpr int kPort = 14540;

/// chase-fcu with a config of these lines.
class Process : public chase::testing::Process {
 public:
  explicit Process(const std::string& config) : chase::testing::Process(CHASE_FCU, config) {}
};

/// The autopilot's end of the wire.
class Wire {
 public:
  virtual ~Wire() = default;
  virtual void Send(const std::vector<uint8_t>& bytes) = 0;
  virtual std::vector<uint8_t> Take() = 0;  ///< empty: nothing has come
};

class UdpWire : public Wire {
 public:
  UdpWire() : fd_(socket(AF_INET, SOCK_DGRAM, 0)) {
    to_.sin_family = AF_INET;
    to_.sin_port = htons(kPort);
    to_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  }
  ~UdpWire() override { close(fd_); }
  void Send(const std::vector<uint8_t>& bytes) override {
    sendto(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&to_), sizeof to_);
  }
  std::vector<uint8_t> Take() override {
    uint8_t buffer[2048];
    const ssize_t n = recv(fd_, buffer, sizeof buffer, MSG_DONTWAIT);
    return n > 0 ? std::vector<uint8_t>(buffer, buffer + n) : std::vector<uint8_t>();
  }

 private:
  int fd_;
  sockaddr_in to_{};
};

class SerialWire : public Wire {
 public:
  SerialWire() : fd_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    grantpt(fd_);
    unlockpt(fd_);
    device = ptsname(fd_);
  }
  ~SerialWire() override { close(fd_); }
  void Send(const std::vector<uint8_t>& bytes) override {
    if (write(fd_, bytes.data(), bytes.size()) < 0) ++dropped;
  }
  std::vector<uint8_t> Take() override {
    uint8_t buffer[2048];
    const ssize_t n = read(fd_, buffer, sizeof buffer);
    return n > 0 ? std::vector<uint8_t>(buffer, buffer + n) : std::vector<uint8_t>();
  }
  std::string device;
  int dropped = 0;

 private:
  int fd_;
};

/// Odometry, control and the autopilot; chase-fcu stands between them.
class World {
 public:
  explicit World(Wire* wire)
      : wire_(wire), bus_(bus::kDefaultUrl, ""), px4(StandInOptions{}, bus_.Now(), 1) {
    bus_.SetIdentity({"control", "", bus_.Now()});
    bus_.Subscribe<imu_t>("IMU", [this](const imu_t& m) {
      ++samples;
      rising = rising && m.utime > last_imu_;
      last_imu_ = m.utime;
      worst_age = std::max(worst_age, 1e-6 * static_cast<double>(bus_.Now() - m.utime));
      least_age = std::min(least_age, 1e-6 * static_cast<double>(bus_.Now() - m.utime));
      up = m.accel[2];
    });
    bus_.Subscribe<status_t>("FCU_STATUS", [this](const status_t& m) { status = m; });
  }

  bool Run(
      double seconds, const std::function<bool()>& until = [] { return false; }) {
    const int64_t end = bus_.Now() + static_cast<int64_t>(1e6 * seconds);
    while (bus_.Now() < end) {
      Step();
      if (until()) return true;
    }
    return false;
  }
  bool RunUntil(const std::string& words, double seconds) {
    return Run(seconds, [&] { return status.detail.find(words) != std::string::npos; });
  }

 private:
  Wire* wire_;
  bus::UdpBus bus_;
  int64_t last_imu_ = 0, next_ = 0;

  void Step() {
    const int64_t now = bus_.Now();
    for (auto bytes = wire_->Take(); !bytes.empty(); bytes = wire_->Take()) px4.Receive(now, bytes);
    px4.Tick(now);
    for (const auto& bytes : px4.TakeOutgoing())
      if (mute == false) wire_->Send(bytes);
    if (now >= next_) {
      next_ = now + 5'000;
      Feed(now);
    }
    bus_.Handle(1'000);
  }

  void Feed(int64_t now) {
    pose_t pose{};
    pose.utime = now;
    bus::Set(pose.pos, px4.p_WB());
    bus::Set(pose.vel, px4.v_WB());
    bus::Set(pose.orientation, px4.R_WB());
    for (int i = 0; i < 9; ++i) pose.local_covariance[10 * i] = 1e-4;
    bus_.Publish("POSE", pose);
    if (!setpoints) return;
    const Eigen::Vector3d a = 2.0 * (Eigen::Vector3d(0, 0, 1.5) - px4.p_WB()) - 2.5 * px4.v_WB();
    const Eigen::Vector3d force = a.cwiseMax(-3.0).cwiseMin(3.0) + Eigen::Vector3d(0, 0, 9.81);
    attitude_setpoint_t m{};
    m.utime = now;
    bus::Set(m.orientation, math::FromZAxisAndYaw(force, 0.0));
    m.thrust = force.norm();
    m.motors = attitude_setpoint_t::MOTORS_ON;
    bus_.Publish("ATTITUDE_SETPOINT", m);
  }

 public:
  StandIn px4;
  bool setpoints = true, mute = false, rising = true;
  int samples = 0;
  double worst_age = -1.0, least_age = 1.0, up = 0.0;
  status_t status{};
};

TEST(FcuLive, FliesOverUdpAndLandsWhenTheSetpointsCease) {
  UdpWire wire;
  World world(&wire);
  Process fcu("port: 14540\n");
  ASSERT_TRUE(world.RunUntil("flying: armed and in OFFBOARD", 25.0))
      << world.status.detail << fcu.errors();
  world.Run(3.0);
  const int samples = world.samples, setpoints = world.px4.seen().setpoints,
            odometry = world.px4.seen().odometry;
  world.worst_age = -1.0;
  world.Run(5.0);
  EXPECT_NEAR(world.px4.p_WB().z(), 1.5, 0.2);
  // A busy machine loses ticks, not time.
  EXPECT_GT(world.samples - samples, 800);
  EXPECT_LT(world.samples - samples, 1050);
  EXPECT_GT(world.px4.seen().setpoints - setpoints, 400);
  EXPECT_LT(world.px4.seen().setpoints - setpoints, 520);
  EXPECT_GT(world.px4.seen().odometry - odometry, 160);
  EXPECT_LT(world.px4.seen().odometry - odometry, 210);
  EXPECT_TRUE(world.rising);
  EXPECT_NEAR(world.up, 9.81, 1.0);
  EXPECT_GT(world.least_age, -0.002) << "stamps of the future";
  EXPECT_EQ(world.status.state, +status_t::OK) << world.status.detail;
  world.setpoints = false;
  EXPECT_TRUE(world.RunUntil("standby: ready for another flight", 20.0)) << world.status.detail;
  EXPECT_FALSE(world.px4.armed());
  EXPECT_NE(world.status.last_error.find("setpoints have ceased"), std::string::npos);
  std::printf("status: %s\n", world.status.detail.c_str());
  EXPECT_EQ(fcu.End(SIGINT), 0) << fcu.errors();
}

TEST(FcuLive, FliesOverASerialLine) {
  SerialWire wire;
  World world(&wire);
  Process fcu("link: " + wire.device + "\n");
  ASSERT_TRUE(world.RunUntil("flying: armed and in OFFBOARD", 25.0))
      << world.status.detail << fcu.errors();
  world.Run(2.0);
  EXPECT_TRUE(world.px4.armed());
  EXPECT_GT(world.samples, 400);
}

TEST(FcuLive, ThePilotTakesItAndAKilledBridgeIsNoDisaster) {
  UdpWire wire;
  World world(&wire);
  Process fcu("port: 14540\n");
  ASSERT_TRUE(world.RunUntil("flying: armed and in OFFBOARD", 25.0)) << world.status.detail;
  world.Run(2.0);
  world.px4.PilotMode({3, 0});
  ASSERT_TRUE(world.RunUntil("pilot: the mode was changed", 5.0)) << world.status.detail;
  fcu.End(SIGKILL);
  Process again("port: 14540\n");
  ASSERT_TRUE(world.RunUntil("pilot: somebody else flies", 10.0)) << world.status.detail;
  world.Run(3.0);
  EXPECT_EQ(world.px4.seen().times_armed, 1);
  EXPECT_FALSE(world.px4.mode() == kOffboardMode);
}

TEST(FcuLive, AForcedKillDisarmsInTheAir) {
  UdpWire wire;
  World world(&wire);
  Process fcu("port: 14540\n");
  ASSERT_TRUE(world.RunUntil("flying: armed and in OFFBOARD", 25.0)) << world.status.detail;
  world.Run(2.0);
  bus::UdpBus station(bus::kDefaultUrl, "");
  station.SetIdentity({"command", "", station.Now()});
  const auto kill = [&](int64_t id, std::vector<double> arguments, int64_t age = 0) {
    command_t m{};
    m.utime = station.Now() - age;
    m.id = id;
    m.kind = command_t::KILL;
    m.arguments = std::move(arguments);
    m.n_arguments = static_cast<int32_t>(m.arguments.size());
    station.Publish("COMMAND", m);
    world.Run(1.0, [&] { return !world.px4.armed(); });
  };
  kill(1, {});
  EXPECT_TRUE(world.px4.armed()) << "not forced";
  kill(3, {1.0}, 11'000'000);
  EXPECT_TRUE(world.px4.armed()) << "of another flight";
  const int64_t before = station.Now();
  kill(2, {1.0});
  EXPECT_FALSE(world.px4.armed());
  std::printf("disarmed %.1f ms after the command\n",
              1e-3 * static_cast<double>(station.Now() - before));
  EXPECT_TRUE(world.RunUntil("done: killed by command", 3.0)) << world.status.detail;
}

TEST(FcuLive, ErrorsSayWhatAndHow) {
  Process no_device("link: /dev/no_such_device\n");
  EXPECT_EQ(no_device.End(0), 1);
  EXPECT_NE(no_device.errors().find("serial device /dev/no_such_device"), std::string::npos);
  EXPECT_NE(no_device.errors().find("check the wiring"), std::string::npos);
  Process no_key("signing_key_file: /no/such/key\n");
  EXPECT_EQ(no_key.End(0), 1);
  EXPECT_NE(no_key.errors().find("64 hexadecimal digits"), std::string::npos);
  UdpWire wire;
  World world(&wire);
  world.mute = true;
  Process fcu("autopilot_silence: 1.5\n");
  EXPECT_TRUE(world.RunUntil("no autopilot heard on UDP port 14540", 8.0)) << world.status.detail;
  EXPECT_TRUE(world.Run(4.0, [&] { return world.status.state == status_t::FAILED; }));
  Process second("port: 14540\n");
  EXPECT_EQ(second.End(0), 1);
  EXPECT_NE(second.errors().find("UDP port 14540: Address already in use; stop the program"),
            std::string::npos)
      << second.errors();
}

}  // namespace
}  // namespace chase::fcu::testing
