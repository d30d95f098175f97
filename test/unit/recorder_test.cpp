#include "deploy/recorder/recorder.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <set>
#include <system_error>
#include <thread>

#include "common/logs/log_reader.h"

namespace {

std::mutex disk;
std::condition_variable disk_is_back;
bool disk_hangs = false;
std::map<ino_t, int64_t> on_disk;  // bytes of each file

}  // namespace

/// In place of the system's: what it would have put on the disk.
extern "C" int fdatasync(int fd) {
  struct stat file {};
  if (fstat(fd, &file) != 0) return -1;
  std::unique_lock lock(disk);
  disk_is_back.wait(lock, [] { return !disk_hangs; });
  on_disk[file.st_ino] = file.st_size;
  return 0;
}

namespace chase::recorder {
namespace {

constexpr int64_t kSecond = 1'000'000;               // us
constexpr int64_t kPlenty = int64_t{1} << 40;        // bytes
constexpr int64_t kStart = 1'800'000'000 * kSecond;  // us
constexpr size_t kLight = 100, kHeavy = 10'000;      // bytes

/// A folder of the test's own and what lies in it.
class RecorderTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("chase-recorder-" + std::to_string(getpid()) +
               testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directory(folder_);
    config_.folder = folder_;
    config_.keep_free_mb = 1.0;
    on_disk.clear();
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// The log was written last at that time, us.
  void SetAge(const std::string& name, int64_t utime) const {
    const auto ago =
        std::chrono::system_clock::now().time_since_epoch() - std::chrono::microseconds(utime);
    last_write_time(folder_ / name, std::filesystem::file_time_type::clock::now() -
                                        std::chrono::duration_cast<std::chrono::seconds>(ago));
  }

  std::set<std::string> Names() const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_))
      names.insert(entry.path().filename());
    return names;
  }

  /// The stamps of a channel in all logs; fails where a log is damaged.
  std::vector<int64_t> Stamps(const std::string& channel, bool whole = true) const {
    std::vector<int64_t> stamps;
    for (const std::string& name : Names()) {
      logs::LogReader log(folder_ / name);
      for (logs::LogEvent event; log.Next(&event);)
        if (event.channel == channel) stamps.push_back(event.utime);
      EXPECT_TRUE(!whole || log.damage().empty()) << name;
    }
    std::sort(stamps.begin(), stamps.end());
    return stamps;
  }

  /// Those of a log that a loss of power would leave.
  int64_t OnDisk(const std::string& name) const {
    struct stat file {};
    stat((folder_ / name).c_str(), &file);
    const std::lock_guard lock(disk);
    const auto at = on_disk.find(file.st_ino);
    return at == on_disk.end() ? 0 : at->second;
  }

  /// How often files of the folder are open.
  int Open() const {
    int open = 0;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
      std::error_code closed;
      open += std::filesystem::read_symlink(entry.path(), closed).parent_path() == folder_;
    }
    return open;
  }

  /// Light and heavy messages, 10 of each a second, over [from, to) seconds.
  void Feed(Recorder* recorder, int from, int to, int64_t free = kPlenty) const {
    const std::vector<uint8_t> bytes(kHeavy, 7);
    for (int64_t k = from * 10; k < to * 10; ++k) {
      const int64_t utime = kStart + k * kSecond / 10;
      recorder->Add(utime, "POSE", false, bytes.data(), kLight);
      recorder->Add(utime, "LIDAR_SCAN", true, bytes.data(), kHeavy);
      recorder->Tick(utime, free);
    }
  }

  static std::vector<int64_t> Expected(int from, int to) {
    std::vector<int64_t> stamps;
    for (int64_t k = from * 10; k < to * 10; ++k) stamps.push_back(kStart + k * kSecond / 10);
    return stamps;
  }

  std::filesystem::path folder_;
  RecorderConfig config_;
};

TEST_F(RecorderTest, LightStaysForEverAndHeavyForItsMinutes) {
  config_.heavy_minutes = 0.5;
  {
    Recorder recorder(config_, "a", kStart);
    Feed(&recorder, 0, 120);
  }
  EXPECT_EQ(Stamps("POSE"), Expected(0, 120));
  const auto heavy = Stamps("LIDAR_SCAN");
  ASSERT_FALSE(heavy.empty());
  EXPECT_EQ(heavy.back(), Expected(0, 120).back());
  EXPECT_GE(heavy.back() - heavy.front(), 29 * kSecond);
  EXPECT_LE(heavy.back() - heavy.front(), 37 * kSecond);  // and the log of 6 s that it is in
}

TEST_F(RecorderTest, HeavyForEverIsInTheOneLog) {
  config_.heavy_minutes = -1.0;
  config_.rotate_minutes = 0.0;
  {
    Recorder recorder(config_, "flight", kStart);
    Feed(&recorder, 0, 60);
  }
  EXPECT_EQ(Names(), std::set<std::string>{"flight.lcm"});
  EXPECT_EQ(Stamps("LIDAR_SCAN"), Expected(0, 60));
}

TEST_F(RecorderTest, LogsThatFollowEachOtherAreReadAsOne) {
  config_.heavy_minutes = 0.0;
  config_.rotate_mb = 0.05;
  {
    Recorder recorder(config_, "a", kStart);
    Feed(&recorder, 0, 60);
  }
  EXPECT_EQ(Names(), (std::set<std::string>{"a.lcm", "a-001.lcm"}));
  EXPECT_EQ(Stamps("POSE"), Expected(0, 60));
}

TEST_F(RecorderTest, ALogThatIsThereIsLeftAlone) {
  config_.heavy_minutes = 0.0;
  for (const int from : {0, 10}) {
    Recorder recorder(config_, "a", kStart);
    Feed(&recorder, from, from + 10);
  }
  EXPECT_EQ(Names(), (std::set<std::string>{"a.lcm", "a-001.lcm"}));
  EXPECT_EQ(Stamps("POSE"), Expected(0, 20));
}

TEST_F(RecorderTest, OnANearlyFullDiskHeavyMakesRoomForLight) {
  config_.heavy_minutes = 0.5;
  {
    Recorder recorder(config_, "a", kStart);
    Feed(&recorder, 0, 20);
    EXPECT_FALSE(recorder.heavy_given_up());
    Feed(&recorder, 20, 40, 500'000);
    EXPECT_TRUE(recorder.heavy_given_up());
    EXPECT_GT(recorder.unrecorded(), 190);
    Feed(&recorder, 40, 50);
    EXPECT_FALSE(recorder.heavy_given_up());
  }
  EXPECT_EQ(Stamps("POSE"), Expected(0, 50));
  const auto heavy = Stamps("LIDAR_SCAN");
  EXPECT_EQ(heavy.back(), Expected(0, 50).back());
  EXPECT_GT(heavy.front(), Expected(0, 12).back());  // the oldest went first
}

TEST_F(RecorderTest, HeavyLogsOfEarlierRecordersMakeRoomFirst) {
  config_.heavy_minutes = 1e6;
  for (const char* name : {"a", "b"}) {
    Recorder recorder(config_, name, kStart);
    Feed(&recorder, 0, 10);
  }
  for (const char* name : {"a-heavy.lcm", "b-heavy.lcm"}) SetAge(name, kStart + 10 * kSecond);
  config_.heavy_minutes = 0.5;
  std::ofstream(folder_ / "a-heavyweights.lcm") << "somebody's";
  {
    Recorder recorder(config_, "b", kStart);
    Feed(&recorder, 10, 20);
    EXPECT_EQ(Names().count("a-heavy.lcm"), 1u) << "there is room";
    recorder.Tick(kStart + 20 * kSecond, 950'000);  // 50 kB too few
    EXPECT_EQ(Names().count("a-heavy.lcm"), 0u);
    EXPECT_EQ(Names().count("b-heavy.lcm"), 1u) << "one is enough, the oldest";
    EXPECT_FALSE(recorder.heavy_given_up());
  }
  EXPECT_EQ(Names().count("a-heavyweights.lcm"), 1u);
  std::filesystem::remove(folder_ / "a-heavyweights.lcm");
  EXPECT_EQ(Stamps("POSE").size(), 300u);
}

/// Power came back long after a crash: what led to it is still there.
TEST_F(RecorderTest, HeavyLogsOfEarlierRecordersAreKeptWhileThereIsRoom) {
  config_.heavy_minutes = 1e6;
  { Feed(std::make_unique<Recorder>(config_, "a", kStart).get(), 0, 1); }
  SetAge("a-heavy.lcm", kStart);
  const int64_t later = kStart + 7200 * kSecond;
  for (const double minutes : {-1.0, 0.0, 0.5}) {
    config_.heavy_minutes = minutes;
    Recorder recorder(config_, "c", later);
    recorder.Tick(later, kPlenty);
    EXPECT_EQ(Names().count("a-heavy.lcm"), 1u) << minutes;
  }
}

/// As a file system's or a user's limit on a file does: the next log takes what comes.
TEST_F(RecorderTest, AFileThatMayNotGrowIsFollowedByAnother) {
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{30'000, before.rlim_max};
  config_.heavy_minutes = 0.0;
  int64_t unrecorded = 0;
  setrlimit(RLIMIT_FSIZE, &small);
  {
    Recorder recorder(config_, "a", kStart);
    Feed(&recorder, 0, 60);
    unrecorded = recorder.unrecorded();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_GE(Names().size(), 3u);
  const auto stamps = Stamps("POSE");
  EXPECT_EQ(static_cast<int64_t>(stamps.size()) + unrecorded, 600);
  EXPECT_GT(stamps.size(), 560u);  // each limit costs what came in the second of the retry
}

TEST_F(RecorderTest, WhatCameIsOnTheDiskSoonAndAllOfALogThatHasEnded) {
  config_.heavy_minutes = 0.5;
  const auto all_on_disk = [&] {
    const auto names = Names();
    return std::all_of(names.begin(), names.end(), [&](const std::string& name) {
      return OnDisk(name) == static_cast<int64_t>(std::filesystem::file_size(folder_ / name));
    });
  };
  {
    Recorder recorder(config_, "a", kStart);
    Feed(&recorder, 0, 20);
    constexpr int kLogs = 2;  // that are written to
    for (int i = 0; i < 500 && !(all_on_disk() && Open() <= kLogs); ++i) {
      recorder.Tick(kStart + 20 * kSecond + i, kPlenty);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_TRUE(all_on_disk());
    EXPECT_LE(Open(), kLogs);
    Feed(&recorder, 20, 21);
  }
  EXPECT_TRUE(all_on_disk());
}

TEST_F(RecorderTest, ALogEndsWhileTheDiskHangs) {
  config_.heavy_minutes = 0.0;
  config_.rotate_mb = 0.005;
  std::atomic<bool> fed = false;
  {
    Recorder recorder(config_, "a", kStart);
    Feed(&recorder, 0, 1);
    {
      const std::lock_guard lock(disk);
      disk_hangs = true;
    }
    std::thread repair([&] {
      for (int i = 0; i < 500 && !fed; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      EXPECT_TRUE(fed);
      {
        const std::lock_guard lock(disk);
        disk_hangs = false;
      }
      disk_is_back.notify_all();
    });
    Feed(&recorder, 1, 20);
    EXPECT_GT(recorder.files(), 3);
    fed = true;
    repair.join();
  }
  EXPECT_EQ(Stamps("POSE"), Expected(0, 20));
  for (const std::string& name : Names())
    EXPECT_EQ(OnDisk(name), static_cast<int64_t>(std::filesystem::file_size(folder_ / name)))
        << name;
}

TEST_F(RecorderTest, AKilledRecorderLeavesAllButItsLastMoment) {
  config_.heavy_minutes = -1.0;
  const pid_t child = fork();
  if (child == 0) {
    Recorder recorder(config_, "a", kStart);
    Feed(&recorder, 0, 20);
    const std::vector<uint8_t> bytes(kHeavy, 7);
    for (int k = 0; k < 50; ++k)  // not put on disk by a tick: written in part
      recorder.Add(kStart + 20 * kSecond + k, "LIDAR_SCAN", true, bytes.data(), bytes.size());
    raise(SIGKILL);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(Stamps("POSE", false), Expected(0, 20));
  logs::LogReader log(folder_ / "a.lcm");
  for (logs::LogEvent event; log.Next(&event);) {
  }
  ASSERT_EQ(log.damage().size(), 1u);
  EXPECT_TRUE(log.damage()[0].at_end);
}

}  // namespace
}  // namespace chase::recorder
