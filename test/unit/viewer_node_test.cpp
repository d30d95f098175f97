#include "services/viewer/viewer_node.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "chase/imu_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/log_writer.h"
#include "services/viewer/log_player.h"
#include "services/viewer/recording.h"
#include "test/unit/viewer_memory_bus.h"

namespace chase::viewer {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

pose_t PoseAt(int64_t utime, double x) {
  pose_t m{};
  m.utime = utime;
  m.pos[0] = x;
  m.orientation[0] = 1.0;
  return m;
}

polynomial_t Constant(int64_t utime) {
  polynomial_t p{};
  p.utime = utime;
  p.duration = 1.0;
  p.n_coefficients = 3;
  p.coefficients = {1, 2, 3};
  return p;
}

plan_t PlanAt(int64_t utime) {
  plan_t m{};
  m.utime = utime;
  m.position = m.target = Constant(utime);
  m.n_yaw = 1;
  m.yaw = {0.0};
  m.stop.duration = 1.0;
  return m;
}

ViewerConfig AnyPort() {
  ViewerConfig config;
  config.address = "127.0.0.1";
  config.port = 0;
  return config;
}

TEST(ViewerNode, WhatNoVehicleKnowsIsHeardOfLogsOnly) {
  MemoryBus live, log;
  ViewerNode looks(live, AnyPort()), plays(log, AnyPort(), "flight.lcm");
  for (const char* channel : {"FAULT", "TRUTH"}) {
    EXPECT_EQ(live.counters().count(channel), 0U);
    EXPECT_EQ(log.counters().count(channel), 1U);
  }
}

TEST(ViewerNode, MalformedMessagesAreCountedAndLeftOut) {
  MemoryBus bus;
  ViewerNode node(bus, AnyPort());
  pose_t pose = PoseAt(bus.now, 1.0);
  pose.pos[1] = kNan;
  bus.Deliver("POSE", pose);
  plan_t plan = PlanAt(bus.now);
  plan.position.n_coefficients = 0;
  plan.position.coefficients.clear();
  bus.Deliver("PLAN", plan);
  EXPECT_EQ(bus.counters().at("POSE").malformed, 1);
  EXPECT_EQ(bus.counters().at("PLAN").malformed, 1);
  bus.Deliver("OBSTACLES", std::vector<uint8_t>{});
  bus.Deliver("OBSTACLES", std::vector<uint8_t>(3, 0xff));
  EXPECT_EQ(bus.counters().at("OBSTACLES").malformed, 2);
  node.Tick(bus.now);
}

TEST(ViewerNode, EmptyListsAreFine) {
  MemoryBus bus;
  ViewerNode node(bus, AnyPort());
  scan_registered_t scan{};
  scan.utime = bus.now;
  scan.orientation[0] = 1.0;
  bus.Deliver("SCAN_REGISTERED", scan);
  obstacles_t obstacles{};
  obstacles.utime = bus.now;
  bus.Deliver("OBSTACLES", obstacles);
  bus.Deliver("PLAN", PlanAt(bus.now));
  bus.Deliver("POSE", PoseAt(bus.now, 1.0));
  status_t status{};
  status.utime = bus.now;
  status.name = "planning";
  status.state = status_t::OK;
  bus.Deliver("PLANNING_STATUS", status);
  for (const auto& [channel, counters] : bus.counters())
    EXPECT_EQ(counters.malformed, 0) << channel;
  EXPECT_EQ(bus.last_error(), "");
  node.Tick(bus.now);
}

/// Good messages with some bytes turned: nothing may end the process, and what is handed on is
/// either good or counted.
TEST(ViewerNode, MutatedMessages) {
  MemoryBus bus;
  ViewerNode node(bus, AnyPort());
  scan_registered_t scan{};
  scan.utime = bus.now;
  scan.orientation[0] = 1.0;
  scan.size = 5;
  scan.x = scan.y = scan.z = {1, 2, 3, 4, 5};
  scan.intensity = scan.ring = {1, 2, 3, 4, 5};
  const std::map<std::string, std::vector<uint8_t>> good = {{"POSE", BytesOf(PoseAt(bus.now, 1.0))},
                                                            {"PLAN", BytesOf(PlanAt(bus.now))},
                                                            {"SCAN_REGISTERED", BytesOf(scan)}};
  std::mt19937 random(5);
  for (int i = 0; i < 6000; ++i) {
    for (const auto& [channel, bytes] : good) {
      auto turned = bytes;
      for (int k = 0; k < 3; ++k)
        turned[8 + random() % (turned.size() - 8)] = static_cast<uint8_t>(random());
      if (i % 7 == 0) turned.resize(random() % turned.size());
      bus.Deliver(channel, turned);
    }
    if (i % 50 == 0) node.Tick(bus.now += kSecond / 10);
  }
  EXPECT_GT(bus.counters().at("POSE").malformed, 0);
  EXPECT_GT(bus.counters().at("POSE").received, 0);
}

TEST(ViewerNode, ShareOfACoreAndPlanTime) {
  status_t a{}, b{};
  a.utime = 10 * kSecond;
  b.utime = 12 * kSecond;
  a.cpu = 1.0;
  b.cpu = 1.5;
  EXPECT_EQ(FromMessage(b, &a).cpu_percent, 25.0);
  EXPECT_LT(FromMessage(b, nullptr).cpu_percent, 0.0);
  EXPECT_LT(FromMessage(a, &a).cpu_percent, 0.0);  // twice the same
  stage_status_t stage{"plan", 10, 2.0, 0, 0, 0};
  a.stages = {stage};
  stage.count = 30;
  stage.mean_ms = 4.0;
  b.stages = {stage};
  EXPECT_NEAR(MeanStageMs(b, a, "plan"), 5.0, 1e-12);  // (30 x 4 - 10 x 2) / 20
  EXPECT_LT(MeanStageMs(a, a, "plan"), 0.0);
  EXPECT_LT(MeanStageMs(b, a, "other"), 0.0);
}

TEST(ViewerNode, ProcessesThatOnlyTheMissionHears) {
  ProcessHealth own;
  own.name = "planning";
  own.rss_mb = 12.0;
  health_t m{};
  m.utime = 5 * kSecond;
  m.processes = {{"lidar", status_t::FAILED, 3.0, 0}, {"planning", status_t::OK, 0.5, 2}};
  const auto rows = Joined({{"planning", own}}, m, 6 * kSecond);
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].name, "lidar");
  EXPECT_EQ(rows[0].state, +status_t::FAILED);
  EXPECT_NEAR(rows[0].age, 4.0, 1e-12);
  EXPECT_EQ(rows[1].restarts, 2);
  EXPECT_EQ(rows[1].rss_mb, 12.0);
  EXPECT_EQ(Joined({{"planning", own}}, {}, 0)[0].restarts, -1);
  m.processes = {{"control", status_t::FAILED, -1.0, 0}};
  const ProcessHealth never = Joined({}, m, 60 * kSecond)[0];
  EXPECT_EQ(never.age, -1.0);
  EXPECT_EQ(never.detail, "never heard");
}

TEST(ViewerNode, TheWorstProcessIsTheSilentOne) {
  ProcessHealth fine, slow, quiet;
  fine.state = status_t::OK;
  slow.state = status_t::DEGRADED;
  quiet.state = status_t::OK;
  quiet.age = 2.6;
  EXPECT_EQ(WorstState({}), -1);
  EXPECT_EQ(WorstState({fine}), +status_t::OK);
  EXPECT_EQ(WorstState({slow, fine}), +status_t::DEGRADED);
  EXPECT_EQ(WorstState({slow, quiet, fine}), +status_t::FAILED);
}

class ViewerPlayer : public ::testing::Test {
 protected:
  ViewerPlayer()
      : file_(std::filesystem::temp_directory_path() /
              ("viewer_" + std::to_string(::getpid()) + ".lcm")) {
    bus::LogWriter log(file_);  // poses each 0.1 s, images each 0.2 s, one stamp that goes back
    for (int i = 0; i <= 50; ++i) {
      const int64_t utime = kSecond + i * kSecond / 10;
      log.Write(utime - (i == 20 ? 1500 : 0), "POSE", BytesOf(PoseAt(utime, i)));
      if (i % 2 == 0) log.Write(utime, "SCAN_REGISTERED", BytesOf(ScanAt(utime)));
      log.Write(utime, "NOBODYS", {1, 2, 3});
    }
    log.Close();
  }
  ~ViewerPlayer() override { std::filesystem::remove(file_); }

  static scan_registered_t ScanAt(int64_t utime) {
    scan_registered_t m{};
    m.utime = utime;
    m.orientation[0] = 1.0;
    return m;
  }
  void Listen(LogPlayer* player) {
    player->Subscribe<pose_t>("POSE", [this](const pose_t& m) { poses_.push_back(m.pos[0]); });
    player->Subscribe<scan_registered_t>("SCAN_REGISTERED", [this](const scan_registered_t&) {
      ++scans_;
      pose_first_ = !poses_.empty();
    });
  }

  std::filesystem::path file_;
  std::vector<double> poses_;
  int scans_ = 0;
  bool pose_first_ = false;  ///< before the last scan
};

TEST_F(ViewerPlayer, SeeksToTheStateAtThatTime) {
  LogPlayer player(file_);
  Listen(&player);
  EXPECT_EQ(player.begin(), kSecond);
  EXPECT_EQ(player.end(), 6 * kSecond);
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const int64_t t = kSecond + static_cast<int64_t>(random() % (5 * kSecond));
    poses_.clear();
    scans_ = 0;
    player.Seek(t);
    ASSERT_EQ(poses_.size(), 1U);
    EXPECT_EQ(poses_[0], std::floor(static_cast<double>(t - kSecond) / (0.1 * kSecond)));
    EXPECT_EQ(scans_, 1);
    EXPECT_TRUE(pose_first_);
    EXPECT_EQ(player.Now(), t);
  }
  for (int i = 0; i <= 50; ++i) {  // at an event's own time it counts
    poses_.clear();
    player.Seek(kSecond + i * kSecond / 10);
    EXPECT_EQ(poses_, std::vector<double>{static_cast<double>(i)});
  }
  poses_.clear();
  player.Seek(0);
  EXPECT_TRUE(poses_.empty());
}

TEST_F(ViewerPlayer, PlaysEverythingOnceAndThinsHeavyChannels) {
  LogPlayer player(file_);
  Listen(&player);
  player.Seek(0);
  for (int64_t t = kSecond / 2; t <= 7 * kSecond; t += kSecond) player.PlayTo(t);
  ASSERT_EQ(poses_.size(), 51U);
  for (size_t i = 0; i < poses_.size(); ++i) EXPECT_EQ(poses_[i], static_cast<double>(i));
  EXPECT_EQ(scans_, 6);    // of 26: one of each step that has any
  player.PlayTo(kSecond);  // not back in time
  EXPECT_EQ(poses_.size(), 51U);
}

TEST_F(ViewerPlayer, SurveysLightChannelsAtEvenTimes) {
  LogPlayer player(file_);
  Listen(&player);
  std::vector<int64_t> times;
  player.Survey(kSecond, [&](int64_t t) {
    times.push_back(t);
    return true;
  });
  EXPECT_EQ(times, (std::vector<int64_t>{2 * kSecond, 3 * kSecond, 4 * kSecond, 5 * kSecond,
                                         6 * kSecond}));
  EXPECT_EQ(poses_.size(), 51U);
  EXPECT_EQ(scans_, 0);
}

/// A stamp a thousand years ahead, and half an hour that the recorder slept.
TEST_F(ViewerPlayer, JumpsOfTheClockAreNotPlayed) {
  bus::LogWriter log(file_);
  for (int i = 0; i <= 50; ++i) {
    const int64_t utime = kSecond + i * kSecond / 10 + (i > 30 ? 1800 * kSecond : 0);
    log.Write(utime + (i == 20 ? 31557600000 * kSecond : 0), "POSE", BytesOf(PoseAt(utime, i)));
  }
  log.Close();
  LogPlayer player(file_);
  Listen(&player);
  size_t ticks = 0;
  const auto count = [&](int64_t) {
    if (++ticks > 1000) throw std::runtime_error("hangs");
    return true;
  };
  EXPECT_NO_THROW(player.Survey(kSecond / 10, count));
  EXPECT_EQ(ticks, 50U);
  EXPECT_EQ(poses_.size(), 51U);
  EXPECT_EQ(player.end(), player.begin() + 5 * kSecond);
  EXPECT_EQ(player.Title(), file_.filename().string() + ", without 3 jumps of its clock");
  ticks = 0;
  player.Survey(kSecond / 10, [&](int64_t) { return ++ticks < 7; });
  EXPECT_EQ(ticks, 7U) << "stops when it is told to";
}

/// By 10 s, as if the log had paused, but no message is missing.
TEST_F(ViewerPlayer, AClockThatWasSetIsNotPlayed) {
  bus::LogWriter log(file_);
  for (int i = 0; i <= 50; ++i) {
    pose_t pose = PoseAt(kSecond + i * kSecond / 10 + (i > 30 ? 10 * kSecond : 0), i);
    pose.seq = i;
    log.Write(pose.utime, "POSE", BytesOf(pose));
  }
  log.Close();
  LogPlayer player(file_);
  EXPECT_LE(std::abs(player.end() - player.begin() - 5 * kSecond), kSecond / 9);
  EXPECT_EQ(player.Title(), file_.filename().string() + ", without 1 jump of its clock");
}

TEST_F(ViewerPlayer, TellsWhatOfTheLogIsLost) {
  std::filesystem::resize_file(file_, std::filesystem::file_size(file_) - 5);
  EXPECT_NE(LogPlayer(file_).Title().find("the log was cut off"), std::string::npos)
      << LogPlayer(file_).Title();
}

TEST_F(ViewerPlayer, RefusesALogOfTwoVehicles) {
  bus::LogWriter log(file_);
  for (const char* channel : {"alpha/POSE", "beta/POSE"})
    log.Write(kSecond, channel, BytesOf(PoseAt(kSecond, 0)));
  log.Close();
  LogPlayer player(file_);
  EXPECT_THROW(Listen(&player), std::runtime_error);
}

TEST_F(ViewerPlayer, ALogIsRecordedForAReport) {
  const Recording recording = RecordLog(file_);
  EXPECT_EQ(recording.duration, 5.0);
  std::map<Part, std::vector<const Recording::Frame*>> frames;
  for (const auto& frame : recording.frames) frames[frame.part].push_back(&frame);
  ASSERT_NEAR(static_cast<double>(frames[Part::kState].size()), 51.0, 2.0);
  for (const auto* frame : frames[Part::kState]) {  // the drone is at x = 10 t
    const auto state = nlohmann::json::parse(frame->bytes);
    EXPECT_NEAR(state["drone"]["p"][0], std::floor(10.0 * frame->t + 1e-6), 1.0);
    EXPECT_NEAR(state["play"]["t"], frame->t, 1e-3);
  }
  EXPECT_NEAR(static_cast<double>(frames[Part::kCloud].size()), 10.0, 2.0) << "two a second";
  EXPECT_GT(nlohmann::json::parse(recording.hello)["rows"].size(), 45u);
  EXPECT_TRUE(std::is_sorted(recording.frames.begin(), recording.frames.end(),
                             [](const auto& a, const auto& b) { return a.t < b.t; }));
}

TEST_F(ViewerPlayer, BadLogs) {
  EXPECT_THROW(LogPlayer("no/such.lcm"), std::runtime_error);
  std::filesystem::resize_file(file_, std::filesystem::file_size(file_) - 20);
  LogPlayer cut(file_);
  Listen(&cut);
  cut.Seek(0);
  cut.PlayTo(10 * kSecond);
  EXPECT_EQ(poses_.size(), 51U);  // the last event was nobody's
  std::filesystem::resize_file(file_, 0);
  EXPECT_THROW(LogPlayer{file_.string()}, std::runtime_error);
}

}  // namespace
}  // namespace chase::viewer
