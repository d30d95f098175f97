// Logs that hold little: a LiDAR's recording, obstacles alone; and that no channel is forgotten.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "chase/event_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "chase/obstacles_t.hpp"
#include "chase/truth_t.hpp"
#include "common/bus/channels.h"
#include "common/bus/log_writer.h"
#include "services/viewer/page_feed.h"
#include "services/viewer/recording.h"
#include "services/viewer/shown_channels.h"
#include "test/unit/viewer_memory_bus.h"

namespace chase::viewer {
namespace {

using nlohmann::json;

std::filesystem::path FileOf(const std::string& channel) {
  return std::filesystem::temp_directory_path() /
         ("viewer_" + channel + std::to_string(::getpid()) + ".lcm");
}

/// A log of two seconds with one message of `make(utime)` each 0.1 s, as the page gets it.
template <class Make>
Recording Recorded(const std::string& channel, const Make& make) {
  const auto file = FileOf(channel);
  bus::LogWriter log(file);
  for (int64_t utime = kSecond; utime <= 3 * kSecond; utime += kSecond / 10)
    log.Write(utime, channel, BytesOf(make(utime)));
  log.Close();
  const std::shared_ptr<void> litter(nullptr, [&](void*) { std::filesystem::remove(file); });
  return RecordLog(file);
}

int CountOf(const Recording& recording, Part part) {
  return static_cast<int>(
      std::count_if(recording.frames.begin(), recording.frames.end(),
                    [part](const Recording::Frame& frame) { return frame.part == part; }));
}

TEST(ViewerAnyLog, SweepsAloneAreShownAndPlayed) {
  const Recording recording = Recorded("LIDAR_SCAN", [](int64_t utime) {
    lidar_scan_t m{};
    m.utime = utime;
    m.size = 2;
    m.x = m.y = m.z = m.t = {0.0F, 1.0F};
    m.intensity = m.ring = {0, 1};
    return m;
  });
  EXPECT_GE(CountOf(recording, Part::kState), 20);
  EXPECT_GE(CountOf(recording, Part::kCloud), 3);
}

TEST(ViewerAnyLog, MoversAreWhereTheirOwnTimeSays) {
  const Recording recording = Recorded("OBSTACLES", [](int64_t utime) {
    obstacle_t mover{};
    mover.kind = obstacle_t::MOVING;
    mover.center.utime = utime;
    mover.center.duration = 1.0;
    mover.center.n_coefficients = 6;
    mover.center.coefficients = {1e-6 * static_cast<double>(utime), 0, 0, 1, 0, 0};  // x = t
    mover.shape[0] = mover.shape[3] = mover.shape[5] = 1.0;
    mover.orientation[0] = mover.existence = 1.0;
    obstacles_t m{};
    m.utime = utime;
    m.n_obstacles = 1;
    m.obstacles = {mover};
    return m;
  });
  ASSERT_GT(CountOf(recording, Part::kObstacles), 2);
  for (const Recording::Frame& frame : recording.frames) {
    if (frame.part != Part::kObstacles) continue;
    EXPECT_NEAR(json::parse(frame.bytes)["rows"][0]["p"][0], 1.0 + frame.t, 0.11);
  }
}

TEST(ViewerAnyLog, InjectedFaultsLastUntilTheyEnd) {
  const Recording recording = Recorded("FAULT", [](int64_t utime) {
    event_t m{};
    m.utime = utime;
    m.name = "lidar_gap";
    m.phase = utime < 2 * kSecond ? event_t::BEGINS : event_t::ENDS;
    return m;
  });
  int struck = 0, calm = 0;
  for (const Recording::Frame& frame : recording.frames) {
    if (frame.part != Part::kState) continue;
    const std::string faults = json::parse(frame.bytes)["row"][16];
    EXPECT_EQ(faults, frame.t < 0.99 ? "lidar_gap" : "") << frame.t;
    ++(faults.empty() ? calm : struck);
  }
  EXPECT_GE(struck, 9);
  EXPECT_GE(calm, 9);
}

TEST(ViewerAnyLog, TheTruthOfASimulationIsTold) {
  const Recording recording = Recorded("TRUTH", [](int64_t utime) {
    truth_t m{};
    m.utime = utime;
    m.pos[0] = 1e-6 * static_cast<double>(utime);
    m.orientation[0] = 1.0;
    m.target_pos[1] = 4.0;
    m.target_yaw = m.n_movers = 2;
    m.movers.resize(2);
    m.movers[1].pos[2] = 0.9;
    return m;
  });
  ASSERT_GT(CountOf(recording, Part::kState), 2);
  for (const Recording::Frame& frame : recording.frames) {
    if (frame.part != Part::kState) continue;
    const json bodies = json::parse(frame.bytes)["truth"];
    ASSERT_EQ(bodies.size(), 4U);
    EXPECT_NEAR(bodies[0]["p"][0], 1.0 + frame.t, 0.11);
    EXPECT_EQ(bodies[1]["p"], json({0.0, 4.0, 0.0}));
    EXPECT_NEAR(bodies[1]["q"][3], std::sin(1.0), 1e-4);
    EXPECT_EQ(bodies[3]["p"][2], 0.9);
  }
}

TEST(ViewerAnyLog, TheTruthIsTheFirstFramesOnly) {
  class Sink : public PageSink {
   public:
    void Send(Part part, std::string bytes, bool /*binary*/) override {
      if (part == Part::kState) state = json::parse(bytes);
    }
    void Retain(Part, std::string) override {}
    bool Wanted(Part) const override { return true; }
    json state;
  } sink;
  MemoryBus bus;
  PageFeed feed(bus, sink, ViewerConfig(), "flight.lcm");
  feed.SetPlay({});
  const auto tells_truth = [&](int epoch) {
    pose_t pose{};
    pose.utime = bus.now;
    pose.epoch = epoch;
    truth_t truth{};
    truth.orientation[0] = 1.0;
    feed.Take(pose);
    feed.Take(truth);
    feed.Tick(bus.now, "");
    return sink.state.contains("truth");
  };
  EXPECT_TRUE(tells_truth(3));
  EXPECT_FALSE(tells_truth(4)) << "POSE is in another frame than TRUTH now";
  EXPECT_TRUE(tells_truth(3)) << "after a seek";
}

TEST(ViewerAnyLog, AVehiclesPrefixMayStandBeforeTheChannels) {
  const auto sweep = [](int64_t utime) {
    lidar_scan_t m{};
    m.utime = utime;
    return m;
  };
  EXPECT_GE(CountOf(Recorded("eagleLIDAR_SCAN", sweep), Part::kCloud), 3);
  EXPECT_THROW(Recorded("LIDAR_SCAN_OF_OTHERS", sweep), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(FileOf("LIDAR_SCAN_OF_OTHERS"))) << "litter";
}

TEST(ViewerAnyLog, EveryChannelIsShownButTruthAndFault) {
  class ListeningBus : public MemoryBus {
   public:
    std::set<std::string> heard;

   protected:
    void SubscribeRaw(const std::string& channel, RawHandler) override { heard.insert(channel); }
  } listener;
  SubscribeShown(listener, [](const char*, const auto&) {});
  for (const bus::ChannelRow& row : bus::ChannelTable())
    EXPECT_EQ(listener.heard.count(row.channel),
              row.channel == "TRUTH" || row.channel == "FAULT" ? 0U : 1U)
        << row.channel;
  std::ifstream file("deploy/processes.json");
  const json processes = json::parse(file)["processes"];
  for (const json& row : processes)
    EXPECT_EQ(listener.heard.count(bus::StatusChannel(row["name"])), 1U) << row["name"];
  SubscribeUnknown(listener, [](const char*, const auto&) {});
  EXPECT_EQ(listener.heard.count("FAULT") + listener.heard.count("TRUTH"), 2U);
}

}  // namespace
}  // namespace chase::viewer
