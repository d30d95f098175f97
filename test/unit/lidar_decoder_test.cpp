#include <gtest/gtest.h>

#include <cmath>

#include "lidar_packets.h"
#include "services/lidar/vlp16.h"

namespace chase::lidar {
namespace {

using testing::MakePacket;
using testing::PacketSpec;

Packet DecodeAll(const PacketSpec& spec) { return Decode(MakePacket(spec).data(), 0.0, 200.0); }

double AzimuthDeg(const Point& p) {
  const double a = std::atan2(-p.y, p.x) * 180 / M_PI;
  return a < 0 ? a + 360 : a;
}

double ElevationDeg(const Point& p) { return std::atan2(p.z, std::hypot(p.x, p.y)) * 180 / M_PI; }

TEST(LidarDecoder, RingsRiseWithElevation) {
  PacketSpec spec;
  spec.range = 100.0;
  for (const Point& p : DecodeAll(spec).points)
    EXPECT_NEAR(ElevationDeg(p), -15.0 + 2.0 * p.ring, 0.02);
}

TEST(LidarDecoder, FramePointsForwardLeftUp) {
  PacketSpec spec;
  spec.step_deg = 0.0;
  EXPECT_NEAR(DecodeAll(spec).points[1].x, 10.0 * std::cos(M_PI / 180), 1e-5);
  spec.azimuth_deg = 270.0;  // azimuth runs clockwise, so this is left
  EXPECT_NEAR(DecodeAll(spec).points[1].y, 10.0 * std::cos(M_PI / 180), 1e-5);
  EXPECT_GT(DecodeAll(spec).points[15].z, 2.5);
  EXPECT_LT(DecodeAll(spec).points[0].z, -2.5);
}

TEST(LidarDecoder, RangeIsKept) {
  PacketSpec spec;
  spec.range = 12.346;
  const Packet packet = DecodeAll(spec);
  ASSERT_EQ(packet.points.size(), 12u * 32u);
  for (const Point& p : packet.points) {
    const double rise = kHeight[p.ring < 8 ? 2u * p.ring : 2u * (p.ring - 8u) + 1u];
    EXPECT_NEAR(std::hypot(p.x, p.y, p.z - rise), 12.346, 1e-5);
  }
}

TEST(LidarDecoder, AzimuthAndTimeAdvanceWithEveryLaser) {
  PacketSpec spec;
  spec.azimuth_deg = 359.0;  // the packet runs through the wrap
  spec.stamp_us = 123456789;
  const Packet packet = DecodeAll(spec);
  EXPECT_EQ(packet.stamp_us, 123456789u);
  ASSERT_EQ(packet.firings.size(), 24u);
  for (size_t i = 0; i < packet.points.size(); ++i) {
    const double t =
        static_cast<double>(i / 16) * 55.296e-6 + static_cast<double>(i % 16) * 2.304e-6;
    EXPECT_NEAR(packet.points[i].t, t, 1e-12);
    const double azimuth = std::fmod(359.0 + 0.4 * t / 110.592e-6, 360.0);
    EXPECT_NEAR(std::remainder(AzimuthDeg(packet.points[i]) - azimuth, 360.0), 0.0, 1e-4);
    EXPECT_EQ(packet.points[i].intensity, i % 32);
  }
}

TEST(LidarDecoder, NoReturnAndRangeLimitsLeavePointsOut) {
  PacketSpec spec;
  spec.range = 0.0;
  EXPECT_TRUE(DecodeAll(spec).points.empty());
  EXPECT_EQ(DecodeAll(spec).firings.size(), 24u);
  spec.range = 5.0;
  EXPECT_TRUE(Decode(MakePacket(spec).data(), 6.0, 100.0).points.empty());
  EXPECT_TRUE(Decode(MakePacket(spec).data(), 0.3, 4.9).points.empty());
}

TEST(LidarDecoder, DualReturnsShareTimeAndDropRepeats) {
  PacketSpec spec;
  spec.mode = 0x39;
  spec.second_range = 20.0;
  const Packet packet = DecodeAll(spec);
  ASSERT_EQ(packet.firings.size(), 12u);
  ASSERT_EQ(packet.points.size(), 12u * 32u);
  for (const Firing& f : packet.firings) {
    ASSERT_EQ(f.end - f.begin, 32u);
    for (size_t laser = 0; laser < 16; ++laser) {
      const Point &a = packet.points[f.begin + laser], &b = packet.points[f.begin + 16 + laser];
      EXPECT_EQ(a.t, b.t);
      EXPECT_NEAR(AzimuthDeg(a), AzimuthDeg(b), 1e-4);
      EXPECT_NEAR(b.x / a.x, 2.0, 1e-5);
    }
  }
  EXPECT_NEAR(packet.firings.back().t, 5 * 110.592e-6 + 55.296e-6, 1e-12);
  spec.second_range = spec.range;
  EXPECT_EQ(DecodeAll(spec).points.size(), 12u * 16u);
}

TEST(LidarDecoder, ProblemNamesWhatIsWrong) {
  auto bytes = MakePacket({});
  EXPECT_EQ(PacketProblem(bytes.data(), bytes.size()), "");
  EXPECT_NE(PacketProblem(bytes.data(), 512).find("512"), std::string::npos);
  bytes[300] = 0;
  EXPECT_NE(PacketProblem(bytes.data(), bytes.size()).find("block 3"), std::string::npos);
  bytes = MakePacket({});
  testing::PutWord(bytes.data() + 102, 36000);
  EXPECT_NE(PacketProblem(bytes.data(), bytes.size()).find("azimuth"), std::string::npos);
}

}  // namespace
}  // namespace chase::lidar
