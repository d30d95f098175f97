#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <numeric>
#include <optional>
#include <random>
#include <set>

#include "chase/camera_image_t.hpp"
#include "chase/status_t.hpp"
#include "common/bus/bus.h"
#include "common/bus/log_writer.h"
#include "common/logs/log_clock.h"
#include "logs/src/info.h"
#include "logs/src/seq_count.h"
#include "test/unit/logs_small_log.h"

namespace chase::logs {
namespace {

using testing::Encoded, testing::ErrorOf, testing::ReadText, testing::Temp, testing::WriteLog;
using testing::WriteText;

TEST(LogInfo, CountsAndTypesEveryChannel) {
  const LogInfo info = Describe(WriteLog("info.lcm"));
  ASSERT_EQ(info.channels.size(), 2u);
  EXPECT_EQ(info.channels[0].channel, "IMU");
  EXPECT_EQ(info.channels[0].type, "imu_t");
  EXPECT_EQ(info.channels[0].count, 20);
  EXPECT_NEAR(info.channels[0].RateHz(), 200.0, 1e-9);
  EXPECT_EQ(info.channels[1].count, 4);
  EXPECT_TRUE(info.Whole());
  EXPECT_EQ(info.channels[0].missing, 0);
}

TEST(LogInfo, TellsVersionHostAndConfiguration) {
  const std::string file = Temp("software.lcm");
  status_t live{}, lockstep{};
  live.name = "planning";
  live.version = "0.1.0 (commit 1a2b), host a, host b, configuration 930766865";
  lockstep.name = "control";
  lockstep.version = "0.1.0 (commit 1a2b)";
  {
    bus::LogWriter out(file);
    out.Write(1, "PLANNING_STATUS", Encoded(live));
    out.Write(2, "CONTROL_STATUS", Encoded(lockstep));
    out.Close();
  }
  const LogInfo info = Describe(file);
  EXPECT_EQ(info.versions.at("planning"), "0.1.0 (commit 1a2b), host a");
  EXPECT_EQ(info.versions.at("control"), "0.1.0 (commit 1a2b)");
  EXPECT_EQ(info.hosts, (std::map<std::string, std::string>{{"planning", "b"}}));
  EXPECT_EQ(info.configurations.at("planning"), "930766865");
  const auto software = info.SoftwareByKind();
  EXPECT_EQ(software.at("versions"), info.versions);
  EXPECT_EQ(software.at("hosts"), info.hosts);
  EXPECT_EQ(software.at("configurations"), info.configurations);
  EXPECT_NE(Format(info).find("host       b (planning)\n"), std::string::npos);
  EXPECT_NE(Format(info).find("planning 930766865\n"), std::string::npos);
}

TEST(LogInfo, ProcessesThatWereStartedAnewAreTold) {
  const std::string file = Temp("restarts.lcm");
  bus::LogWriter out(file);
  int64_t utime = 0;
  for (const auto& [name, start] : std::vector<std::pair<std::string, int64_t>>{
           {"planning", 1}, {"control", 1}, {"planning", 1}, {"planning", 5}, {"planning", 9}}) {
    status_t status{};
    status.name = status.sender = name;
    status.sender_start = start;
    out.Write(++utime, name == "control" ? "CONTROL_STATUS" : "PLANNING_STATUS", Encoded(status));
  }
  out.Close();
  const LogInfo info = Describe(file);
  EXPECT_EQ(info.restarts, (std::map<std::string, int>{{"planning", 2}}));
  EXPECT_NE(Format(info).find("planning: started anew, 2 times"), std::string::npos);
}

TEST(LogInfo, WhatOthersHeardAndTheLogLacksIsMissingButTicksAreNot) {
  const std::string file = Temp("heard.lcm");
  status_t status{};
  bus::LogWriter out(file);
  for (int k = 1; k <= 5; ++k) {
    status.inputs = {{"IMU", 10 * k}, {bus::Bus::kTick, 2 * k}};
    status.n_inputs = 2;
    out.Write(k, "CONTROL_STATUS", Encoded(status));
  }
  out.Close();
  const LogInfo info = Describe(file);
  ASSERT_EQ(info.channels.size(), 2u);
  EXPECT_EQ(info.channels[1].channel, "IMU");
  EXPECT_EQ(info.channels[1].missing, 41);
}

TEST(LogInfo, WhatOthersHeardBehindTheLastMessageIsMissing) {
  const std::string file = Temp("behind.lcm");
  bus::LogWriter out(file);
  const auto hear = [&](int64_t utime, int32_t seq) {
    status_t status{};
    status.inputs = {{"IMU", seq}};
    status.n_inputs = 1;
    out.Write(utime, "CONTROL_STATUS", Encoded(status));
  };
  hear(1, 5000);  // of the process that sent IMU before
  for (int k = 0; k < 10; ++k) {
    imu_t imu = testing::Imu(k);
    imu.sender_start = 2;
    out.Write(10 + k, "IMU", Encoded(imu));
  }
  hear(30, 12);
  out.Close();
  const LogInfo info = Describe(file);
  ASSERT_EQ(info.channels.size(), 2u);
  EXPECT_EQ(info.channels[1].missing, 3);
  EXPECT_EQ(info.channels[1].longest_gap, 11);
}

/// Images of those numbers, and a recorder in `state` where that is given.
bool RecordedWith(const std::vector<int32_t>& seqs, std::optional<int8_t> state = {}) {
  const std::string file = Temp("images.lcm");
  bus::LogWriter out(file);
  int64_t utime = 1;
  for (const int32_t seq : seqs) {
    camera_image_t image{};
    image.seq = seq;
    image.sender_start = 1;  // after the log's beginning: its first number is 0
    out.Write(utime++, "v1/CAMERA_IMAGE", Encoded(image));
  }
  status_t status{};
  status.name = "recorder";
  status.state = state.value_or(status_t::OK);
  if (state) out.Write(utime, "v1/RECORDER_STATUS", Encoded(status));
  out.Close();
  return Describe(file).Recorded();
}

TEST(LogInfo, HeavyChannelsLoseAsLittleUnlessTheRecorderLeftThemOut) {
  std::vector<int32_t> whole(200), tail(whole.begin() + 100, whole.end());
  std::iota(whole.begin(), whole.end(), 0);
  std::iota(tail.begin(), tail.end(), 100);
  EXPECT_TRUE(RecordedWith(whole));
  EXPECT_TRUE(RecordedWith(tail)) << "a recorder drops its oldest heavy logs";
  std::vector<int32_t> half;
  for (int32_t seq = 0; seq < 200; seq += 2) half.push_back(seq);
  EXPECT_FALSE(RecordedWith(half));
  EXPECT_FALSE(RecordedWith(half, status_t::OK));
  EXPECT_TRUE(RecordedWith(half, status_t::DEGRADED)) << "the disk was nearly full";
}

TEST(LogInfo, LightChannelsLoseNothing) {
  for (const int32_t lost : {-1, 500}) {
    const std::string file = Temp("light.lcm");
    bus::LogWriter out(file);
    for (int k = 0; k < 1000; ++k)
      if (k != lost) out.Write(5000 * k, "IMU", Encoded(testing::Imu(k)));
    out.Close();
    const LogInfo info = Describe(file);
    EXPECT_EQ(info.Recorded(), lost < 0);
    EXPECT_EQ(info.Losses().size(), lost < 0 ? 0u : 1u);
  }
}

TEST(LogInfo, TellsTheLongestGapAndWhenItBegan) {
  const std::string file = Temp("gap.lcm");
  bus::LogWriter out(file);
  for (int k = 0; k < 1000; ++k)
    if (k <= 500 || k > 530) out.Write(7'000'000 + 5000 * k, "IMU", Encoded(testing::Imu(k)));
  out.Close();
  const LogInfo info = Describe(file);
  EXPECT_EQ(info.channels.at(0).longest_gap, 31 * 5000);
  EXPECT_EQ(info.channels.at(0).gap_begins, 500 * 5000);
  ASSERT_EQ(info.Losses().size(), 2u);
  EXPECT_EQ(info.Losses()[1],
            "IMU: longest gap 0.15 s, from 2.5 s of the log on; its period is 0.005 s");
}

TEST(LogInfo, MessagesThatCannotBeReadAreToldAndNotRecorded) {
  for (const int bad : {1, 20}) {
    const std::string file = Temp("unreadable.lcm");
    bus::LogWriter out(file);
    for (int k = 0; k < 20; ++k) {
      const Bytes bytes = Encoded(testing::Imu(k));
      out.Write(5000 * k, "IMU", k < bad ? Bytes(bytes.size()) : bytes);
      out.Write(5000 * k, "OTHERS", {1, 2, 3});
    }
    out.Close();
    const LogInfo info = Describe(file);
    EXPECT_EQ(info.channels.at(0).unreadable, bad);
    EXPECT_EQ(info.channels.at(0).type, bad < 20 ? "imu_t" : "");
    EXPECT_EQ(info.channels.at(1).unreadable, 0) << "nobody here can tell";
    EXPECT_FALSE(info.Recorded());
    ASSERT_FALSE(info.Losses().empty());
    EXPECT_EQ(info.Losses()[0], "IMU: " + std::to_string(bad) +
                                    (bad == 1 ? " message" : " messages") +
                                    " cannot be read (of another version, or damaged; see "
                                    "chase-log migrate)");
  }
}

/// IMU at 200 Hz, its stamps later by `by` us from the 500th on, which `lost` come before.
LogInfo WithStep(int64_t by, int lost) {
  const std::string file = Temp("step.lcm");
  bus::LogWriter out(file);
  for (int k = 0; k < 1000; ++k)
    out.Write(7'000'000'000 + 5000 * k + (k < 500 ? 0 : by), "IMU",
              Encoded(testing::Imu(k < 500 ? k : k + lost)));
  out.Close();
  return Describe(file);
}

TEST(LogInfo, AClockThatWasSetIsToldAndDoesNotCount) {
  for (const int64_t by : std::vector<int64_t>{3'600'000'000, -3'600'000'000, -1'000'000}) {
    const LogInfo info = WithStep(by, 0);
    ASSERT_EQ(info.Losses().size(), 1u);
    EXPECT_EQ(info.Losses()[0], by > 0 ? "clock stepped by +3600.0 s at 2.5 s of the log"
                                : by < -10'000'000
                                    ? "clock stepped by -3600.0 s at 2.5 s of the log"
                                    : "clock stepped by -1.0 s at 2.5 s of the log");
    EXPECT_NEAR(info.channels.at(0).RateHz(), 200.0, 0.3);
    EXPECT_LE(info.channels.at(0).longest_gap, 5000);
    EXPECT_NE(Format(info).find("5.0 s of logical time"), std::string::npos) << Format(info);
  }
  EXPECT_EQ(WithStep(3'600'000'000, 9).clock_steps.size(), 0u) << "a pause of the log";
  EXPECT_EQ(WithStep(-2000, 0).clock_steps.size(), 0u) << "stamps go back by a little";
}

TEST(LogInfo, AClockThatWasSetIsToldThoughARareChannelComesFirst) {
  for (const int64_t by : {5'000'000, -5'000'000}) {
    const std::string file = Temp("rare.lcm");
    bus::LogWriter out(file);
    for (int k = 0; k < 1000; ++k) {
      const int64_t utime = 7'000'000'000 + 5000 * k + (k < 600 ? 0 : by);
      if (k % 200 == 0) out.Write(utime, "GYRO", Encoded(testing::Imu(k / 200 + 1)));
      out.Write(utime, "IMU", Encoded(testing::Imu(k)));
    }
    out.Close();
    const LogInfo info = Describe(file);
    ASSERT_EQ(info.clock_steps.size(), 1u);
    EXPECT_LE(std::abs(info.clock_steps[0].by - by), 5000);
    EXPECT_NEAR(info.channels.at(1).RateHz(), 200.0, 0.3);
    EXPECT_LE(info.channels.at(0).last_utime, info.channels.at(1).last_utime);
  }
}

TEST(LogClock, StampsOfBeforeAStepAreKnownForAWhile) {
  const int64_t by = 10'000'000;
  LogClock clock;
  const auto add = [&](int64_t utime, const char* channel, Bytes bytes) {
    LogEvent e;
    e.utime = utime, e.channel = channel, e.bytes = std::move(bytes);
    return clock.Add(e);
  };
  int64_t now = 7'000'000'000;
  for (int k = 0; k < 1000; ++k, now += 5000) {
    const int64_t utime = now + (k < 500 ? 0 : by);
    if (k % 250 == 0) {  // the first behind the step cannot tell, nor one that has no head
      add(utime, "GYRO", Encoded(testing::Imu(k / 250 + 1)));
      EXPECT_LE(std::abs(add(utime, "OTHERS", {1, 2, 3}) - now), 5000) << k;
    }
    add(utime, "IMU", Encoded(testing::Imu(k)));
    if (k == 500) {
      EXPECT_EQ(clock.SetBy(now - 100'000), 0);
    }
  }
  EXPECT_NEAR(static_cast<double>(clock.SetBy(now + by - 6'000'000)), static_cast<double>(by),
              5000.0);
}

TEST(LogInfo, ALogCutOffAnywhereIsReadAsFarAsItGoes) {
  const std::string whole = ReadText(WriteLog("whole.lcm"));
  for (size_t n = 4; n < whole.size(); n += 101) {
    const LogInfo info = Describe(WriteText("cut.lcm", whole.substr(0, n)));
    long count = 0;
    for (const auto& c : info.channels) count += c.count;
    EXPECT_LT(count, 24);
  }
}

TEST(SeqCount, CountsWhatNeverCameInAnyOrder) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    std::vector<int32_t> numbers(1 + random() % 60);
    for (int32_t& n : numbers) n = static_cast<int32_t>(random() % 80);
    SeqCount count;
    for (const int32_t n : numbers) count.Add(n);
    const std::set<int32_t> different(numbers.begin(), numbers.end());
    const auto span = *different.rbegin() - *different.begin() + 1;
    EXPECT_EQ(count.missing(), span - static_cast<int64_t>(different.size())) << "round " << round;
    EXPECT_EQ(count.first(), *different.begin());
    EXPECT_EQ(count.last(), *different.rbegin());
  }
}

TEST(SeqCount, TakesTheWholeRangeOfNumbers) {
  SeqCount count;
  for (const int32_t n : {INT32_MAX, INT32_MIN, 0}) count.Add(n);
  EXPECT_EQ(count.missing(), (int64_t{1} << 32) - 3);
}

TEST(LogInfo, WhatIsNoLogIsRefusedInOneLine) {
  EXPECT_NE(ErrorOf([] { Describe("/nonexistent.lcm"); }).find("no such file"), std::string::npos);
  EXPECT_NE(ErrorOf([] { Describe(WriteText("t.lcm", "text")); }).find("no LCM log"),
            std::string::npos);
  EXPECT_NE(ErrorOf([] { Describe(WriteText("e.lcm", "")); }).find("empty"), std::string::npos);
  EXPECT_NE(ErrorOf([] { Describe("/tmp"); }).find("no regular file"), std::string::npos);
}

}  // namespace
}  // namespace chase::logs
