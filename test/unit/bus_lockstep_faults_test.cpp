#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/bus/live_loop.h"
#include "common/bus/lockstep.h"
#include "common/world/random.h"

namespace chase::bus {
namespace {

constexpr int64_t kStart = 1000000, kPeriod = 5000, kUnderWay = 1000;  // us

lidar_scan_t Scan(int64_t utime, int32_t points) {
  lidar_scan_t scan{};
  scan.utime = utime;
  scan.size = points;
  const auto n = static_cast<size_t>(points);
  scan.x = scan.y = scan.z = scan.t = std::vector<float>(n);
  scan.intensity.resize(n);
  scan.ring.resize(n);
  return scan;
}

/// Sends an IMU sample on each tick and a heavy message on every fourth.
class Source : public Node {
 public:
  Source(Bus& bus, int32_t points) : bus_(bus), points_(points) {}
  int64_t TickPeriod() const override { return kPeriod; }
  void Tick(int64_t utime) override {
    imu_t imu{};
    imu.utime = utime;
    bus_.Publish("IMU", imu);
    if (count_++ % 4 == 0) bus_.Publish("LIDAR_SCAN", Scan(utime, points_));
  }

 private:
  Bus& bus_;
  int32_t points_;
  int count_ = 0;
};

/// What happened to the struck process, over all its lives.
struct Story {
  int lives = 0;
  std::vector<int64_t> samples, sweeps, ticks;       // utime of what was handled
  std::vector<int64_t> handled_at;                   // logical time, of each sample
  std::vector<std::pair<int64_t, int32_t>> answers;  // utime and seq of what came out
  std::vector<int32_t> statuses;                     // seq

  bool operator==(const Story& o) const {
    return lives == o.lives && samples == o.samples && sweeps == o.sweeps && ticks == o.ticks &&
           handled_at == o.handled_at && answers == o.answers && statuses == o.statuses;
  }
};

/// Answers every sample by a setpoint that carries its time.
class Struck : public Node {
 public:
  Struck(Bus& bus, Story* story) : story_(story) {
    ++story->lives;
    bus.Subscribe<imu_t>("IMU", [&bus, story](const imu_t& imu) {
      story->samples.push_back(imu.utime);
      story->handled_at.push_back(bus.Now());
      attitude_setpoint_t out{};
      out.utime = imu.utime;
      out.orientation[0] = 1.0;
      bus.Publish("ATTITUDE_SETPOINT", out);
    });
    bus.Subscribe<lidar_scan_t>(
        "LIDAR_SCAN", [story](const lidar_scan_t& m) { story->sweeps.push_back(m.utime); });
  }
  int64_t TickPeriod() const override { return 10000; }
  void Tick(int64_t utime) override { story_->ticks.push_back(utime); }

 private:
  Story* story_;
};

/// Flies until `end` with what `plan` does to the process "struck"; sweeps have so many points.
Story Lived(int64_t end, const std::function<void(Lockstep*)>& plan, int32_t points = 0) {
  Story story;
  Lockstep lockstep(kStart);
  plan(&lockstep);
  lockstep.Add("source", kUnderWay,
               [=](Bus& bus) { return std::make_unique<Source>(bus, points); });
  lockstep.Add("struck", 3000, [&](Bus& bus) { return std::make_unique<Struck>(bus, &story); });
  const auto ears = [&](int64_t, const std::string& channel, const Bus::Bytes& bytes) {
    const int size = static_cast<int>(bytes.size());
    attitude_setpoint_t setpoint;
    status_t status;
    if (channel == "ATTITUDE_SETPOINT" && setpoint.decode(bytes.data(), 0, size) == size)
      story.answers.push_back({setpoint.utime, setpoint.seq});
    if (channel == "STRUCK_STATUS" && status.decode(bytes.data(), 0, size) == size)
      story.statuses.push_back(status.seq);
  };
  lockstep.SetTap(ears);
  lockstep.RunUntil(end);
  return story;
}

/// utime of the source's messages that arrive from `from` until before `to`; every `step`-th tick.
std::vector<int64_t> Arriving(int64_t from, int64_t to, int64_t step = 1) {
  std::vector<int64_t> utimes;
  for (int64_t t = kStart; t + kUnderWay < to; t += step * kPeriod)
    if (t + kUnderWay >= from) utimes.push_back(t);
  return utimes;
}

std::vector<int64_t> Joined(std::vector<int64_t> a, const std::vector<int64_t>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// A time of no event, so that order at equal times does not matter.
int64_t Between(world::Random* random, double from, double to) {
  return static_cast<int64_t>(random->Uniform(from, to) * 1e3) * 1000 + 137;
}

TEST(LockstepKill, LosesWhatComesMeanwhileAndStartsAfresh) {
  for (uint64_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    world::Random random(seed);
    const int64_t kill = Between(&random, 1.01, 2.0), start = kill + Between(&random, 0.0, 1.0);
    const int64_t end = 4000137;
    const Story story = Lived(end, [&](Lockstep* lockstep) {
      lockstep->At(kill, [=] { lockstep->Kill("struck"); });
      lockstep->At(start, [=] { lockstep->Start("struck"); });
    });
    EXPECT_EQ(story.lives, 2);
    const auto before = Arriving(0, kill), after = Arriving(start, end);
    EXPECT_EQ(story.samples, Joined(before, after));
    EXPECT_EQ(story.sweeps, Joined(Arriving(0, kill, 4), Arriving(start, end, 4)));
    // What left before the kill still arrives; the new process numbers from 0.
    ASSERT_GE(story.answers.size(), before.size());
    for (size_t i = 0; i < story.answers.size(); ++i) {
      const size_t of_life = i < before.size() ? i : i - before.size();
      EXPECT_EQ(story.answers[i].first, story.samples[i]);
      EXPECT_EQ(story.answers[i].second, static_cast<int32_t>(of_life));
    }
    const auto first_tick = std::find(story.ticks.begin(), story.ticks.end(), start);
    ASSERT_NE(first_tick, story.ticks.end()) << "a new process ticks at once";
    EXPECT_LT(*(first_tick - 1), kill);
    ASSERT_FALSE(story.statuses.empty());
    EXPECT_EQ(std::count(story.statuses.begin(), story.statuses.end(), 0), kill > 2000000 ? 2 : 1);
  }
}

TEST(LockstepFreeze, HandlesWhatFoundRoomInOrderAtTheThaw) {
  for (uint64_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    world::Random random(seed);
    const int64_t freeze = Between(&random, 1.01, 2.0), thaw = freeze + Between(&random, 0.0, 4.0);
    const int64_t end = 7000137;
    const Story story = Lived(end, [&](Lockstep* lockstep) {
      lockstep->At(freeze, [=] { lockstep->Freeze("struck"); });
      lockstep->At(thaw, [=] { lockstep->Thaw("struck"); });
    });
    EXPECT_EQ(story.lives, 1);
    auto kept = Arriving(freeze, thaw), kept_sweeps = Arriving(freeze, thaw, 4);
    kept.resize(std::min<size_t>(kept.size(), 400));  // the newest are lost
    kept_sweeps.resize(std::min<size_t>(kept_sweeps.size(), 10));
    const auto before = Arriving(0, freeze);
    EXPECT_EQ(story.samples, Joined(Joined(before, kept), Arriving(thaw, end)));
    EXPECT_EQ(story.sweeps,
              Joined(Joined(Arriving(0, freeze, 4), kept_sweeps), Arriving(thaw, end, 4)));
    for (size_t i = 0; i < kept.size(); ++i) EXPECT_EQ(story.handled_at[before.size() + i], thaw);
    for (size_t i = 0; i < story.answers.size(); ++i)
      EXPECT_EQ(story.answers[i].second, static_cast<int32_t>(i)) << "the same process goes on";
  }
}

TEST(LockstepFreeze, TheSocketHoldsTheOldestFourMebibytesOfAllThatIsSent) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    world::Random random(seed);
    const int64_t freeze = Between(&random, 1.01, 1.5), thaw = freeze + Between(&random, 0.1, 0.9);
    const auto points = static_cast<int32_t>(random.Uniform(5000.0, 30000.0));
    const Story story = Lived(
        2500137,
        [&](Lockstep* lockstep) {
          lockstep->At(freeze, [=] { lockstep->Freeze("struck"); });
          lockstep->At(thaw, [=] { lockstep->Thaw("struck"); });
        },
        points);
    int64_t bytes = 0;
    size_t kept = 0, kept_sweeps = 0;
    for (const int64_t t : Arriving(freeze, thaw)) {  // a sample, then perhaps a sweep
      bytes += imu_t{}.getEncodedSize() + kPerMessage;
      kept += bytes <= 4 * 1024 * 1024;
      if ((t - kStart) % (4 * kPeriod) != 0) continue;
      bytes += Scan(t, points).getEncodedSize() + kPerMessage;
      kept_sweeps += bytes <= 4 * 1024 * 1024 && kept_sweeps < 10;
    }
    EXPECT_EQ(story.samples.size(),
              Arriving(0, freeze).size() + kept + Arriving(thaw, 2500137).size());
    EXPECT_EQ(story.sweeps.size(),
              Arriving(0, freeze, 4).size() + kept_sweeps + Arriving(thaw, 2500137, 4).size());
  }
}

TEST(LockstepFreeze, TicksAreCaughtUpOrTimeSlipsAsInTheLiveLoop) {
  for (uint64_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    world::Random random(seed);
    const int64_t freeze = Between(&random, 1.01, 2.0), thaw = freeze + Between(&random, 0.0, 1.2);
    const Story story = Lived(5000137, [&](Lockstep* lockstep) {
      lockstep->At(freeze, [=] { lockstep->Freeze("struck"); });
      lockstep->At(thaw, [=] { lockstep->Thaw("struck"); });
    });
    for (size_t i = 1; i < story.ticks.size(); ++i)
      ASSERT_EQ(story.ticks[i] - story.ticks[i - 1], 10000) << "never a tick less";
    const int64_t first_late = (freeze / 10000 + 1) * 10000, lag = thaw - first_late;
    // Half a second is caught up; what is later starts again at the thaw.
    const int64_t ticks =
        lag <= 500000 ? 401 : (first_late - kStart) / 10000 + (5000137 - thaw) / 10000 + 1;
    EXPECT_EQ(static_cast<int64_t>(story.ticks.size()), ticks);
  }
}

TEST(LockstepFreeze, SendsNoSignOfLife) {
  const Story story = Lived(4500000, [](Lockstep* lockstep) {
    lockstep->At(1500000, [=] { lockstep->Freeze("struck"); });
    lockstep->At(3700000, [=] { lockstep->Thaw("struck"); });
  });
  EXPECT_EQ(story.statuses, (std::vector<int32_t>{0}));  // at the thaw; the next is due at 4.7 s
}

/// Random strikes, also on the dead and the frozen: nothing is handled twice or out of order, and
/// the same strikes give the same story.
TEST(LockstepFaults, AnyOrderOfStrikesIsSurvivedAndRepeats) {
  for (uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    const auto strikes = [seed](Lockstep* lockstep) {
      world::Random random(seed);
      for (int i = 0; i < 40; ++i) {
        const int64_t at = Between(&random, 1.0, 4.0);
        const std::vector<std::function<void()>> kinds = {
            [=] { lockstep->Kill("struck"); }, [=] { lockstep->Start("struck"); },
            [=] { lockstep->Freeze("struck"); }, [=] { lockstep->Thaw("struck"); }};
        lockstep->At(at, kinds[random.Next() % kinds.size()]);
      }
      lockstep->At(4100000, [=] { lockstep->Thaw("struck"); });
      lockstep->At(4200000, [=] { lockstep->Start("struck"); });
    };
    const Story story = Lived(5000137, strikes);
    for (const auto* utimes : {&story.samples, &story.sweeps})
      EXPECT_TRUE(std::is_sorted(utimes->begin(), utimes->end(), std::less_equal<>()));
    EXPECT_EQ(story.answers.size() + (story.answers.back().first != story.samples.back()),
              story.samples.size());
    EXPECT_EQ(story.samples.back(), Arriving(0, 5000137).back()) << "it lives at the end";
    const auto firsts = std::count_if(story.answers.begin(), story.answers.end(),
                                      [](const auto& a) { return a.second == 0; });
    EXPECT_LE(firsts, story.lives);  // a short life may have heard nothing
    EXPECT_GE(firsts, 1);
    EXPECT_TRUE(story == Lived(5000137, strikes));
  }
}

TEST(LockstepDelay, StrikesOneChannelForItsTime) {
  const Story story = Lived(3000137, [](Lockstep* lockstep) {
    lockstep->At(1500137, [=] { lockstep->SetDelay("IMU", 300000); });
    lockstep->At(2000137, [=] { lockstep->SetDelay("IMU", 0); });
  });
  EXPECT_EQ(story.samples.size(), Arriving(0, 3000137).size()) << "late, not lost";
  EXPECT_EQ(story.sweeps, Arriving(0, 3000137, 4));
  for (size_t i = 0; i < story.samples.size(); ++i) {
    const bool late = story.samples[i] > 1500137 && story.samples[i] < 2000137;
    EXPECT_EQ(story.handled_at[i] - story.samples[i], kUnderWay + (late ? 300000 : 0));
  }
}

TEST(LockstepLoad, MakesEveryProcessSlowForItsTime) {
  const Story story = Lived(3000137, [](Lockstep* lockstep) {
    lockstep->At(1500137, [=] { lockstep->SetLoad(5.0); });
    lockstep->At(2000137, [=] { lockstep->SetLoad(1.0); });
  });
  EXPECT_EQ(story.samples.size(), Arriving(0, 3000137).size());
  for (size_t i = 0; i < story.samples.size(); ++i) {
    const bool busy = story.samples[i] > 1500137 && story.samples[i] < 2000137;
    EXPECT_EQ(story.handled_at[i] - story.samples[i], kUnderWay * (busy ? 5 : 1));
  }
}

// A process sends one message after the other.
TEST(LockstepLoad, LetsNothingOvertakeWhenItEnds) {
  const Story story = Lived(4000137, [](Lockstep* lockstep) {
    lockstep->At(1500137, [=] { lockstep->SetLoad(1000.0); });
    lockstep->At(1600137, [=] { lockstep->SetLoad(1.0); });
  });
  EXPECT_GT(story.handled_at.back() - kUnderWay, 0);
  EXPECT_TRUE(std::is_sorted(story.samples.begin(), story.samples.end()));
}

TEST(LockstepLoss, TakesItsShareOfHeavyAndLightAlikeAndRepeats) {
  const auto plan = [](Lockstep* lockstep) {
    lockstep->At(2000137, [=] { lockstep->SetLoss(0.2, 7); });
    lockstep->At(42000137, [=] { lockstep->SetLoss(0.0, 0); });
  };
  const Story story = Lived(43000137, plan);
  const auto lost = [](const std::vector<int64_t>& heard, int64_t step) {
    return static_cast<double>(Arriving(0, 43000137, step).size() - heard.size()) /
           static_cast<double>(40000000 / kPeriod / step);
  };
  EXPECT_NEAR(lost(story.samples, 1), 0.2, 3.0 * 0.4 / std::sqrt(8000.0));
  EXPECT_NEAR(lost(story.sweeps, 4), 0.2, 3.0 * 0.4 / std::sqrt(2000.0));
  EXPECT_EQ(story.samples.front(), kStart);
  EXPECT_EQ(story.samples.back(), Arriving(0, 43000137).back());
  EXPECT_TRUE(story == Lived(43000137, plan));
}

TEST(LockstepInject, BytesThatAreNoMessageAreCountedAndChangeNothing) {
  const auto flooded = [](Lockstep* lockstep) {
    for (int64_t t = kStart + 137; t < 2000137; t += 1000)
      lockstep->At(t, [=] { lockstep->Inject("IMU", Bus::Bytes(static_cast<size_t>(t % 99), 3)); });
  };
  EXPECT_TRUE(Lived(3000137, flooded) == Lived(3000137, [](Lockstep*) {}));
}

TEST(LockstepFaults, AnUnknownProcessIsNamed) {
  Lockstep lockstep(kStart);
  try {
    lockstep.Kill("nobody");
    FAIL() << "killed";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("nobody"), std::string::npos);
  }
}

}  // namespace
}  // namespace chase::bus
