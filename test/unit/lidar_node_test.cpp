#include "services/lidar/lidar_node.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "chase/lidar_scan_t.hpp"
#include "common/bus/host_clock.h"
#include "common/bus/lockstep.h"
#include "lidar_packets.h"
#include "test/flight/wall_clock.h"

namespace chase::lidar {
namespace {

constexpr int64_t kStart = 50'000'000;

std::string WritePackets(const std::string& name, int packets, uint8_t product = 0x22) {
  const std::string file = ::testing::TempDir() + name;
  std::ofstream out(file, std::ios::binary);
  for (int k = 0; k < packets; ++k) {
    auto bytes = testing::StreamPacket(k, 150.0, 777000);
    bytes[1205] = product;
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<long>(bytes.size()));
  }
  return file;
}

struct Flown {
  std::vector<std::pair<int64_t, lidar_scan_t>> scans;
  bool done = false;
  bus::NodeReport report;
};

Flown Fly(const std::string& file, int64_t duration_us) {
  Flown flown;
  LidarConfig config;
  config.source = file;
  bus::Lockstep lockstep(kStart);
  const bus::Node* node = nullptr;
  lockstep.Add("lidar", 0, [&](bus::Bus& bus) {
    auto made = std::make_unique<LidarNode>(bus, config);
    node = made.get();
    return made;
  });
  lockstep.SetTap([&](int64_t utime, const std::string& channel, const bus::Bus::Bytes& bytes) {
    lidar_scan_t scan;
    if (channel == "LIDAR_SCAN" && scan.decode(bytes.data(), 0, static_cast<int>(bytes.size())) > 0)
      flown.scans.emplace_back(utime, scan);
  });
  lockstep.RunUntil(kStart + duration_us);
  flown.done = node->Done();
  flown.report = node->Report();
  return flown;
}

TEST(LidarNode, ARecordingPlaysAtItsOwnPace) {
  const Flown flown = Fly(WritePackets("node.bin", 500), 1'000'000);  // 0.66 s
  ASSERT_EQ(flown.scans.size(), 6u);
  for (size_t i = 0; i < flown.scans.size(); ++i) {
    const auto& [sent, scan] = flown.scans[i];
    EXPECT_EQ(scan.seq, static_cast<int>(i));
    EXPECT_GE(sent, scan.utime + 99'900);  // not before it is complete
    EXPECT_LE(sent, scan.utime + 130'000);
    EXPECT_GT(scan.size, 28000);
    EXPECT_EQ(static_cast<size_t>(scan.size), scan.ring.size());
  }
  EXPECT_NEAR(static_cast<double>(flown.scans[1].second.utime - flown.scans[0].second.utime), 1e5,
              100.0);
  EXPECT_TRUE(flown.done);
  EXPECT_EQ(flown.report.state, bus::NodeReport::State::kOk);
}

TEST(LidarNode, HalfARecordingIsNotDone) {
  const Flown flown = Fly(WritePackets("half.bin", 500), 300'000);
  EXPECT_FALSE(flown.done);
  EXPECT_EQ(flown.scans.size(), 2u);
}

TEST(LidarNode, AnotherSensorIsReportedAndPublishesNothing) {
  const Flown flown = Fly(WritePackets("hires.bin", 500, 0x24), 1'000'000);
  EXPECT_TRUE(flown.scans.empty());
  EXPECT_TRUE(flown.done);
  EXPECT_EQ(flown.report.state, bus::NodeReport::State::kFailed);
  EXPECT_NE(flown.report.detail.find("Hi-Res"), std::string::npos);
  EXPECT_EQ(flown.report.detail.find("anew"), std::string::npos) << "a recording has no sensor";
}

/// A sensor on UDP. The node's clock is the lockstep's.
class Live {
 public:
  Live() : socket_(socket(AF_INET, SOCK_DGRAM, 0)) {
    LidarConfig config;
    config.port = testing::FreePort();
    to_.sin_family = AF_INET;
    to_.sin_port = htons(static_cast<uint16_t>(config.port));
    to_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    lockstep_.Add("lidar", 0, [&, config](bus::Bus& bus) {
      auto made = std::make_unique<LidarNode>(bus, config);
      node_ = made.get();
      return made;
    });
    lockstep_.SetTap([&](int64_t, const std::string& channel, const bus::Bus::Bytes& bytes) {
      lidar_scan_t scan;
      if (channel == "LIDAR_SCAN" &&
          scan.decode(bytes.data(), 0, static_cast<int>(bytes.size())) > 0)
        stamps.push_back(scan.utime);
    });
  }
  ~Live() { close(socket_); }
  template <class Bytes>
  void Send(const Bytes& bytes) {
    sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&to_), sizeof to_);
  }
  void Run(int64_t us) { lockstep_.RunUntil(now_ += us); }
  /// 10 ms of packets. The wall clock is set by `step`, us, while they wait.
  void Sweep(uint8_t product = 0x22, int64_t step = 0) {
    for (int i = 0; i < 8; ++i) {
      auto bytes = testing::StreamPacket(packets_++, 150.0, 777000);
      bytes[1205] = product;
      Send(bytes);
    }
    if (step != 0) *ChaseClockSteps() = {bus::WallMicroseconds(), step};
    Run(10'000);
  }
  bus::NodeReport report() const { return node_->Report(); }
  bus::NodeReport::State state() const { return report().state; }
  std::vector<int64_t> stamps;  ///< of all sweeps, us

 private:
  int socket_;
  sockaddr_in to_{};
  int64_t now_ = kStart;
  int packets_ = 0;
  bus::Lockstep lockstep_{kStart};
  const bus::Node* node_ = nullptr;
};

TEST(LidarNode, ASensorThatNeverSpokeHasFailedAfterTwoSeconds) {
  Live live;
  live.Run(1'900'000);
  EXPECT_EQ(live.state(), bus::NodeReport::State::kStarting);
  live.Run(300'000);
  EXPECT_EQ(live.state(), bus::NodeReport::State::kFailed);
  for (int i = 0; i < 40; ++i) live.Sweep();
  EXPECT_EQ(live.state(), bus::NodeReport::State::kOk) << "late";
}

TEST(LidarNode, AfterAnotherSensorTheRightOneNeedsANewStart) {
  Live live;
  live.Sweep(0x24);
  for (int i = 0; i < 40; ++i) live.Sweep();
  EXPECT_EQ(live.state(), bus::NodeReport::State::kFailed);
  EXPECT_NE(live.report().detail.find("Hi-Res"), std::string::npos);
  EXPECT_NE(live.report().detail.find("connect a VLP-16, then start this process anew"),
            std::string::npos)
      << live.report().detail;
}

TEST(LidarNode, BytesThatAreNoPacketKeepNoSensorAlive) {
  Live live;
  for (int i = 0; i < 40; ++i) live.Sweep();
  ASSERT_EQ(live.state(), bus::NodeReport::State::kOk);
  for (int i = 0; i < 30; ++i) {
    live.Send(std::string(1206, 'x'));
    live.Run(10'000);
  }
  EXPECT_EQ(live.state(), bus::NodeReport::State::kFailed);
}

TEST(LidarNode, SweepsGoOnAtTheirPaceWhereTheWallClockIsSet) {
  for (const int64_t step : {400'000, -400'000, 5'000'000, -5'000'000}) {
    Live live;
    for (int i = 0; i < 80; ++i) live.Sweep(0x22, i == 40 ? step : 0);
    ASSERT_GE(live.stamps.size(), 7u);
    for (size_t i = 1; i < live.stamps.size(); ++i)
      EXPECT_NEAR(static_cast<double>(live.stamps[i] - live.stamps[i - 1]), 1e5, 2e4) << step;
    *ChaseClockSteps() = {};
  }
}

}  // namespace
}  // namespace chase::lidar
