#include <gtest/gtest.h>

#include "common/math/clock_alignment.h"
#include "lidar_packets.h"
#include "services/lidar/gps_clock.h"
#include "services/lidar/model_check.h"
#include "services/lidar/sweep_assembler.h"

namespace chase::lidar {
namespace {

using testing::Bytes;
using testing::MakePacket;
using testing::PacketSpec;
using testing::StreamPacket;

struct Assembled {
  std::vector<Sweep> sweeps;
  SweepAssembler assembler;
};

Assembled Assemble(int packets, double cut_deg, uint32_t first_stamp_us = 1000, int skip = -1) {
  LidarConfig config;
  config.cut_azimuth_deg = cut_deg;
  Assembled run{{}, SweepAssembler(config)};
  for (int k = 0; k < packets; ++k) {
    if (k == skip) continue;
    const Bytes bytes = StreamPacket(k, 103.0, first_stamp_us);
    for (Sweep& s : run.assembler.Add(bytes.data(), bytes.size()))
      run.sweeps.push_back(std::move(s));
  }
  return run;
}

TEST(LidarSweep, WholeTurnsFromTheFirstPacketOn) {
  Assembled run = Assemble(1000, -1.0);
  ASSERT_EQ(run.sweeps.size(), 13u);
  for (size_t i = 0; i < run.sweeps.size(); ++i) {
    const Sweep& s = run.sweeps[i];
    EXPECT_NEAR(static_cast<double>(s.device_us), 1000.0 + 1e5 * static_cast<double>(i), 60.0);
    EXPECT_GT(s.covered_deg, 359.5);
    EXPECT_NEAR(static_cast<double>(s.points.size()), 1e5 / 55.296 * 16, 17.0);
    EXPECT_GE(s.points.front().t, 0.0);
    EXPECT_NEAR(s.points.back().t, 0.1, 2e-4);
  }
  EXPECT_FALSE(run.assembler.Finish());
  EXPECT_EQ(run.assembler.broken_off(), 1);
  EXPECT_EQ(run.assembler.lost(), 0);
}

TEST(LidarSweep, FixedCutLeavesPartialTurnsOut) {
  const Assembled run = Assemble(1000, 180.0);
  ASSERT_EQ(run.sweeps.size(), 13u);
  for (const Sweep& s : run.sweeps) {
    EXPECT_LT(s.points.front().x, 0.0);
    EXPECT_NEAR(s.points.front().y / s.points.front().x, 0.0, 0.01);
  }
}

TEST(LidarSweep, TimesNeverGoBack) {
  for (const Sweep& s : Assemble(300, 180.0).sweeps)
    for (size_t i = 1; i < s.points.size(); ++i) ASSERT_GE(s.points[i].t, s.points[i - 1].t);
}

TEST(LidarSweep, TheHourlyWrapOfTheStampIsUnwound) {
  const Assembled run = Assemble(300, -1.0, 3600000000u - 150000u);
  ASSERT_EQ(run.sweeps.size(), 3u);
  EXPECT_NEAR(static_cast<double>(run.sweeps[2].device_us - run.sweeps[0].device_us), 2e5, 60.0);
  EXPECT_EQ(run.assembler.lost(), 0);
}

TEST(LidarSweep, LostPacketsAreCountedAndLeaveAGap) {
  const Assembled whole = Assemble(200, -1.0), gap = Assemble(200, -1.0, 1000, 40);
  EXPECT_EQ(gap.assembler.lost(), 1);
  ASSERT_EQ(gap.sweeps.size(), whole.sweeps.size());
  EXPECT_EQ(gap.sweeps[0].points.size() + 384, whole.sweeps[0].points.size());
  EXPECT_EQ(gap.sweeps[0].points.back().t, whole.sweeps[0].points.back().t);
}

TEST(LidarSweep, MalformedPacketsAreCountedAndHarmless) {
  SweepAssembler assembler{LidarConfig{}};
  Bytes junk{};
  EXPECT_TRUE(assembler.Add(junk.data(), junk.size()).empty());
  EXPECT_TRUE(assembler.Add(junk.data(), 17).empty());
  EXPECT_EQ(assembler.malformed(), 2);
}

ModelCheck::Verdict Judge(ModelCheck* check, uint32_t interval_us, uint8_t product,
                          uint8_t mode = 0x37, int packets = 2) {
  for (int k = 0; k < packets; ++k) {
    PacketSpec spec;
    spec.product = product;
    spec.mode = mode;
    spec.stamp_us = 5000 + static_cast<uint32_t>(k) * interval_us;
    check->Add(MakePacket(spec).data());
  }
  return check->verdict();
}

TEST(LidarModelCheck, TimingDecidesNotTheProductByte) {
  ModelCheck vlp, mislabelled, hdl, hdl_dual, dual, hires, lossy, odd;
  using Verdict = ModelCheck::Verdict;
  EXPECT_EQ(Judge(&vlp, 1327, 0x22), Verdict::kVlp16);
  EXPECT_EQ(Judge(&mislabelled, 1328, 0x21), Verdict::kVlp16);
  EXPECT_EQ(Judge(&hdl, 553, 0x21), Verdict::kOther);
  EXPECT_NE(hdl.reason().find("HDL-32E"), std::string::npos);
  EXPECT_NE(hdl.reason().find("553 us"), std::string::npos);
  EXPECT_EQ(Judge(&hdl_dual, 276, 0x21, 0x39), Verdict::kOther);
  EXPECT_EQ(Judge(&dual, 664, 0x22, 0x39), Verdict::kVlp16);
  EXPECT_EQ(Judge(&hires, 1327, 0x24), Verdict::kOther);
  EXPECT_EQ(Judge(&lossy, 2654, 0x22), Verdict::kUndecided);
  EXPECT_EQ(Judge(&odd, 2000, 0x22, 0x37, 60), Verdict::kOther);
}

TEST(LidarClockAlignment, LateArrivalsDoNotMoveTheClock) {
  math::ClockAlignment clock;
  for (int k = 0; k < 1000; ++k) clock.Add(k * 1327, 7'000'000 + k * 1327 + (k * 7919) % 9000);
  EXPECT_NEAR(static_cast<double>(clock.HostTime(0)), 7'000'000.0, 200.0);
}

TEST(LidarClockAlignment, ASlowSensorClockIsFollowed) {
  math::ClockAlignment clock;
  int64_t device = 0;
  for (int k = 0; k < 100000; ++k) {  // 50 ppm over 133 s
    device += 1327;
    clock.Add(device, device + device / 20000);
  }
  EXPECT_NEAR(static_cast<double>(clock.HostTime(device)),
              static_cast<double>(device + device / 20000), 10.0);
}

/// The sensor is switched off and on, or gets its time from a GPS.
TEST(LidarClockAlignment, AClockThatWasSetIsFollowedAtOnce) {
  for (const int64_t jump : {-3'000'000'000LL, 1'500'000'000LL}) {
    math::ClockAlignment clock;
    for (int k = 0; k < 1000; ++k) clock.Add(5'000'000'000 + 1327 * k, 9'000'000'000 + 1327 * k);
    clock.Add(5'000'000'000 + jump, 9'100'000'000);
    EXPECT_EQ(clock.HostTime(5'000'000'000 + jump), 9'100'000'000);
    EXPECT_EQ(clock.restarts(), 1);
  }
}

/// By chrony, in steps of less than a second.
TEST(LidarClockAlignment, AClockThatWasSetBackALittleIsFollowedAfterASecond) {
  for (const int64_t jump : {-300'000, -25'000, 300'000}) {
    math::ClockAlignment clock(20'000);
    int64_t host = 9'000'000'000;
    const auto feed = [&](int64_t offset, int64_t us) {
      for (const int64_t end = host + us; host < end; host += 1327)
        clock.Add(host - offset, host + host * 7919 % 9000);
    };
    feed(4'000'000'000, 2'000'000);
    feed(4'000'000'000 - jump, 1'100'000);
    EXPECT_NEAR(static_cast<double>(clock.HostTime(0)), 4e9 - static_cast<double>(jump), 200.0);
    EXPECT_EQ(clock.restarts(), jump < 0 ? 1 : 0);
  }
}

/// A processor or a network that is busy, but for one packet.
TEST(LidarClockAlignment, ADelayOfLessThanASecondDoesNotMoveTheClock) {
  math::ClockAlignment clock(20'000);
  for (int64_t t = 0; t < 5'000'000; t += 10'000)
    clock.Add(t, 7'000'000 + t + (t % 900'000 == 0 ? 0 : 300'000));
  EXPECT_NEAR(static_cast<double>(clock.HostTime(0)), 7'000'000.0, 600.0);
  EXPECT_EQ(clock.restarts(), 0);
}

/// Video that is decoded late for a while keeps its times.
TEST(LidarClockAlignment, WithoutALimitALongDelayDoesNotMoveTheClock) {
  math::ClockAlignment clock;
  for (int64_t t = 0; t < 5'000'000; t += 10'000)
    clock.Add(t, 7'000'000 + t + (t < 1'000'000 ? 0 : 300'000));
  EXPECT_NEAR(static_cast<double>(clock.HostTime(0)), 7'000'000.0, 600.0);
}

TEST(LidarSweeps, APauseMakesNoSweepOfTwoHalves) {
  SweepAssembler assembler(LidarConfig{});
  std::vector<Sweep> sweeps;
  const auto feed = [&](int from, int to, uint32_t first_stamp) {
    for (int k = from; k < to; ++k) {
      const Bytes bytes = StreamPacket(k, 150.0, first_stamp);
      for (Sweep& sweep : assembler.Add(bytes.data(), bytes.size())) sweeps.push_back(sweep);
    }
  };
  feed(0, 110, 777'000);       // 1.46 turns
  feed(110, 330, 20'777'000);  // 20 s later
  EXPECT_EQ(assembler.lost(), 0) << "a pause is no loss";
  EXPECT_EQ(assembler.broken_off(), 1);
  ASSERT_GE(sweeps.size(), 2u);
  for (const Sweep& sweep : sweeps) EXPECT_LT(sweep.points.back().t, 0.101);
}

/// Position packets say whether a GPS holds the clock; stamps count from the hour of UTC.
TEST(LidarGpsClock, StampsAreTimeOfDayWhileThePulseIsLocked) {
  constexpr int64_t kHour = 3'600'000'000, kNoon = 1'800'000'000LL * 1'000'000 / kHour * kHour;
  std::array<uint8_t, 512> packet{};
  GpsClock clock;
  EXPECT_FALSE(clock.Utc(1'000, kNoon + 2'000));
  EXPECT_NE(clock.Problem(kNoon).find("no position packet"), std::string::npos);
  packet[202] = 1;
  clock.Hear(packet.data(), packet.size(), kNoon);
  EXPECT_FALSE(clock.Utc(1'000, kNoon + 2'000));
  EXPECT_NE(clock.Problem(kNoon).find("not locked"), std::string::npos);
  packet[202] = 2;
  clock.Hear(packet.data(), packet.size() - 1, kNoon);  // not one
  EXPECT_FALSE(clock.Utc(1'000, kNoon + 2'000));
  clock.Hear(packet.data(), packet.size(), kNoon);
  EXPECT_EQ(clock.Utc(1'000, kNoon + 2'000), kNoon + 1'000);
  EXPECT_EQ(clock.Utc(7 * kHour + 1'000, kNoon + 2'000), kNoon + 1'000) << "unwrapped";
  EXPECT_EQ(clock.Utc(kHour - 1'000, kNoon + 1'000), kNoon - 1'000) << "before the hour";
  EXPECT_EQ(clock.Utc(1'000, kNoon - 500), kNoon + 1'000) << "after it";
  EXPECT_FALSE(clock.Utc(1'000, kNoon + 50'000)) << "the host's clock is off";
  EXPECT_NE(clock.Problem(kNoon + 50'000).find("by more than 20 ms"), std::string::npos);
  EXPECT_EQ(clock.Utc(4'000'000, kNoon + 4'000'000), kNoon + 4'000'000);
  EXPECT_FALSE(clock.Utc(6'000'000, kNoon + 6'000'000)) << "silent for 6 s";
}

}  // namespace
}  // namespace chase::lidar
