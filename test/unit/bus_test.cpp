#include "common/bus/bus.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "common/bus/convert.h"
#include "common/bus/host_clock.h"
#include "common/bus/lockstep.h"
#include "common/bus/log_bus.h"
#include "common/bus/part_file.h"
#include "common/bus/run_service.h"
#include "common/bus/stamp_order.h"
#include "common/bus/status.h"
#include "common/config/version.h"

namespace chase::bus {
namespace {

/// Answers every IMU sample by a setpoint that carries its time.
class Echo : public Node {
 public:
  explicit Echo(Bus& bus) {
    bus.Subscribe<imu_t>("IMU", [&bus](const imu_t& imu) {
      attitude_setpoint_t out{};
      out.utime = imu.utime;
      out.orientation[0] = 1.0;
      bus.Publish("ATTITUDE_SETPOINT", out);
    });
  }
};

/// Sends an IMU sample on each tick and notes when the setpoints arrive.
class Source : public Node {
 public:
  explicit Source(Bus& bus) : bus_(bus) {
    bus.Subscribe<attitude_setpoint_t>("ATTITUDE_SETPOINT", [this](const attitude_setpoint_t& m) {
      delays.push_back(bus_.Now() - m.utime);
    });
  }
  int64_t TickPeriod() const override { return 5000; }
  void Tick(int64_t utime) override {
    imu_t imu{};
    imu.utime = utime;
    bus_.Publish("IMU", imu);
  }
  std::vector<int64_t> delays;

 private:
  Bus& bus_;
};

std::string TempFile(const std::string& name) {
  return testing::TempDir() + name + std::to_string(getpid());
}

std::string Bytes(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(Status, ALiveVersionTellsHostAndConfiguration) {
  char host[256] = "";
  ASSERT_EQ(gethostname(host, sizeof host), 0);
  const std::string version = LiveVersion("123456789");
  EXPECT_EQ(version, config::Version() + ", host " + host + ", configuration 930766865");
}

TEST(Status, ResidentMemoryIsThatOfNow) {
  Lockstep lockstep(1000000);
  double before = 0.0, with = 0.0, after = 0.0;
  lockstep.Add("source", 0, [&](Bus& bus) {
    auto node = std::make_unique<Source>(bus);
    StatusReporter reporter("source");
    const auto resident = [&] { return reporter.Make(bus, *node, 1000000, true).rss_mb; };
    before = resident();
    constexpr size_t kSize = 64 << 20;
    void* block = mmap(nullptr, kSize, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    std::memset(block, 1, kSize);
    with = resident();
    munmap(block, kSize);
    after = resident();
    return node;
  });
  EXPECT_GT(before, 1.0);
  EXPECT_GT(with - before, 60.0);
  // What a sanitizer keeps of a block's shadow stays after it: the block itself is what goes.
  EXPECT_NEAR(with - after, 64.0, 4.0) << "not the peak";
}

TEST(Lockstep, DeliversAfterEachProcessLatency) {
  Lockstep lockstep(1000000);
  Source* source = nullptr;
  lockstep.Add("source", 0, [&](Bus& bus) {
    auto node = std::make_unique<Source>(bus);
    source = node.get();
    return node;
  });
  lockstep.Add("control", 3000, [](Bus& bus) { return std::make_unique<Echo>(bus); });
  lockstep.RunUntil(1000000 + 100000);
  ASSERT_EQ(source->delays.size(), 20u);  // the answer to the last tick is under way
  for (const int64_t delay : source->delays) EXPECT_EQ(delay, 3000);
}

std::string RecordLockstep(const std::string& file) {
  LogWriter log(file);
  Lockstep lockstep(1000000);
  lockstep.SetTap([&](int64_t utime, const std::string& channel, const Bus::Bytes& bytes) {
    log.Write(utime, channel, bytes);
  });
  lockstep.Add("source", 0, [](Bus& bus) { return std::make_unique<Source>(bus); });
  lockstep.Add("control", 2000, [](Bus& bus) { return std::make_unique<Echo>(bus); });
  lockstep.RunUntil(3500000);
  log.Close();
  return Bytes(file);
}

TEST(Lockstep, TwoRunsAreByteIdentical) {
  const std::string a = RecordLockstep(TempFile("a")), b = RecordLockstep(TempFile("b"));
  EXPECT_GT(a.size(), 10000u);
  EXPECT_EQ(a, b);
}

TEST(LogBus, RefusesALogWithoutTheNodesChannels) {
  const std::string in = testing::TempDir() + "/foreign.lcm",
                    out = testing::TempDir() + "/none.lcm";
  LogWriter writer(in);
  writer.Write(1, "POSE", {1});
  writer.Close();
  std::filesystem::remove(out);
  try {
    LogBus bus(in, out);
    Echo node(bus);
    bus.Run(&node);
    FAIL() << "replayed without an input";
  } catch (const std::runtime_error& e) {
    EXPECT_EQ(e.what(), in + ": holds none of the channels that are heard: IMU");
  }
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(LogBus, ReplayAnswersWithTheInputsStampAndRepeats) {
  const std::string in = TempFile("in");
  RecordLockstep(in);
  std::string outputs[2];
  for (auto& output : outputs) {
    const std::string out = TempFile("out");
    LogBus bus(in, out);
    Echo echo(bus);
    bus.Run(&echo);
    output = Bytes(out);
    lcm::LogFile log(out, "r");
    int count = 0;
    while (const lcm::LogEvent* event = log.readNextEvent()) {
      attitude_setpoint_t m;
      ASSERT_GT(m.decode(event->data, 0, event->datalen), 0);
      EXPECT_EQ(m.utime, event->timestamp);
      EXPECT_EQ(m.seq, count++);
    }
    EXPECT_EQ(count, 501);
  }
  EXPECT_EQ(outputs[0], outputs[1]);
}

/// Tells on each tick how many IMU samples came before it.
class Counter : public Node {
 public:
  explicit Counter(Bus& bus) : bus_(bus) {
    bus.Subscribe<imu_t>("IMU", [this](const imu_t&) { ++heard_; });
  }
  int64_t TickPeriod() const override { return 30'000; }
  void Tick(int64_t /*utime*/) override {
    imu_t count{};
    count.utime = heard_;
    bus_.Publish("COUNT", count);
  }

 private:
  Bus& bus_;
  int64_t heard_ = 0;
};

/// A bus whose messages come when the test says so, and go into a log.
class HandBus : public Bus {
 public:
  explicit HandBus(LogWriter* log) : log_(log) {}
  void Hand(const std::string& channel, const Bytes& bytes) {
    log_->Write(now, channel, bytes);
    handlers_.at(channel)(bytes.data(), bytes.size());
  }
  int64_t Now() const override { return now; }
  int64_t now = 1'700'000'000'000'000;  // a live log's, us

 protected:
  void SubscribeRaw(const std::string& channel, RawHandler handler) override {
    handlers_[channel] = std::move(handler);
  }
  void PublishRaw(const std::string& channel, Bytes bytes) override {
    log_->Write(now, channel, bytes);
  }

 private:
  LogWriter* log_;
  std::map<std::string, RawHandler> handlers_;
};

std::vector<Bus::Bytes> Messages(const std::string& file, const std::string& channel) {
  lcm::LogFile log(file, "r");
  std::vector<Bus::Bytes> messages;
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    const auto* data = static_cast<const uint8_t*>(event->data);
    if (event->channel == channel) messages.emplace_back(data, data + event->datalen);
  }
  return messages;
}

TEST(LogBus, TicksALiveProcessWhereItWasTicked) {
  const std::string in = TempFile("ticked"), out = TempFile("ticked_out");
  LogWriter log(in);
  HandBus live(&log);
  live.SetIdentity({"counter", "", live.now});
  Counter node(live);
  for (int k = 0; k < 400; ++k) {
    imu_t imu{};
    imu.seq = k;
    Bus::Bytes bytes(static_cast<size_t>(imu.getEncodedSize()));
    imu.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    live.now += 5000;
    live.Hand("IMU", bytes);
    if (k * k % 7 != 2) continue;  // ticks that come when they can
    live.now += 1000;
    live.CountTick();
    node.Tick(live.now);
  }
  log.Close();
  LogBus replay(in, out);
  replay.SetIdentity(IdentityIn(in, "counter"));
  Counter again(replay);
  replay.Run(&again);
  EXPECT_EQ(Messages(out, "COUNT"), Messages(in, "COUNT"));
  EXPECT_GT(Messages(out, "COUNT").size(), 100u);
}

template <class T>
Bus::Bytes Encoded(const T& message) {
  Bus::Bytes bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// Runs a service and returns its exit code.
int Called(const ServiceSpec& spec, std::vector<std::string> arguments) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  return RunService(spec, static_cast<int>(argv.size()), argv.data());
}

TEST(LogBus, AVehiclesLogIsReplayedUnderItsPrefix) {
  const std::string one = TempFile("one"), two = TempFile("two"), out = TempFile("vehicle_out");
  LogWriter of_one(one), of_two(two);
  imu_t imu{};
  for (int k = 0; k < 30; ++k) {
    imu.seq = k;
    imu.vehicle = "falcon_";
    of_one.Write(1000 * k, "falcon_IMU", Encoded(imu));
    of_two.Write(1000 * k, "falcon_IMU", Encoded(imu));
    imu.vehicle = "eagle_";
    if (k < 10) of_two.Write(1000 * k, "eagle_IMU", Encoded(imu));
  }
  of_one.Close();
  of_two.Close();
  ServiceSpec spec;
  spec.name = "control";
  spec.dump_config = [] { return ""; };
  spec.make_node = [](Bus& bus) { return std::make_unique<Echo>(bus); };
  EXPECT_EQ(Called(spec, {"chase-control", "--replay", one, "--out", out}), 0);
  EXPECT_EQ(Messages(out, "falcon_ATTITUDE_SETPOINT").size(), 30u);
  EXPECT_EQ(
      Called(spec, {"chase-control", "--replay", two, "--out", out, "--channel-prefix", "eagle_"}),
      0);
  EXPECT_EQ(Messages(out, "eagle_ATTITUDE_SETPOINT").size(), 10u);
  attitude_setpoint_t answer;
  const auto first = Messages(out, "eagle_ATTITUDE_SETPOINT").front();
  ASSERT_GT(answer.decode(first.data(), 0, static_cast<int>(first.size())), 0);
  EXPECT_EQ(answer.vehicle, "eagle_");
  testing::internal::CaptureStderr();
  EXPECT_EQ(Called(spec, {"chase-control", "--replay", two, "--out", out}), 1);
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "chase-control: " + two +
                ": is of several vehicles, 'eagle_', 'falcon_'; name one with --channel-prefix\n");
}

/// What a replay with the configuration "123456789", whose cksum is 930766865, says on stderr of a
/// log whose process told `flown` as its version.
std::string ComplaintAbout(const std::string& flown) {
  const std::string in = TempFile("flown"), out = TempFile("flown_out");
  LogWriter log(in);
  log.Write(1, "IMU", Encoded(imu_t{}));
  status_t status{};
  status.sender = status.name = "counter";
  status.version = flown;
  log.Write(2, "COUNTER_STATUS", Encoded(status));
  log.Close();
  ServiceSpec spec;
  spec.name = "counter";
  spec.dump_config = [] { return "123456789"; };
  spec.make_node = [](Bus& bus) { return std::make_unique<Counter>(bus); };
  testing::internal::CaptureStderr();
  EXPECT_EQ(Called(spec, {"chase-counter", "--replay", in, "--out", out}), 0);
  return testing::internal::GetCapturedStderr();
}

TEST(LogBus, AReplayTellsThatItIsNotOfWhatFlew) {
  EXPECT_EQ(ComplaintAbout(LiveVersion("123456789")), "");
  EXPECT_EQ(ComplaintAbout(config::Version()), "") << "an older version tells no configuration";
  const std::string configured = ComplaintAbout(LiveVersion("other"));
  EXPECT_NE(configured.find("flown with configuration 910063178"), std::string::npos) << configured;
  EXPECT_NE(configured.find("this is configuration 930766865"), std::string::npos) << configured;
  EXPECT_NE(configured.find("use --config"), std::string::npos) << configured;
  const std::string commit = ComplaintAbout("0.0.1 (commit 1a2b), host b, configuration 930766865");
  EXPECT_NE(commit.find("flown with configuration 930766865, 0.0.1 (commit 1a2b); this is"),
            std::string::npos)
      << commit;
  EXPECT_EQ(commit.find("--config"), std::string::npos) << "it is the one that flew";
}

TEST(LogBus, MissingInputIsAnErrorAndLeavesNoOutput) {
  const std::string out = TempFile("none");
  {
    LogBus bus("/no/such.lcm", out);
    Echo echo(bus);
    EXPECT_THROW(bus.Run(&echo), std::runtime_error);
  }
  EXPECT_NE(access(out.c_str(), F_OK), 0);
}

TEST(PartFile, StandsInForAFileUntilItIsComplete) {
  const std::string file = TempFile("part");
  std::remove(file.c_str());
  {
    PartFile part(file);
    std::ofstream(part.name()) << "half";
  }
  EXPECT_FALSE(std::filesystem::exists(file));
  EXPECT_FALSE(std::filesystem::exists(file + ".tmp"));
  PartFile part(file);
  std::ofstream(part.name()) << "whole";
  EXPECT_TRUE(part.Complete());
  EXPECT_EQ(std::filesystem::file_size(file), 5u);
  EXPECT_FALSE(std::filesystem::exists(file + ".tmp"));
}

TEST(PartFile, NeverReplacesADeviceOrAPipe) {
  const std::string pipe = TempFile("pipe");
  std::remove(pipe.c_str());
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  {
    PartFile part(pipe);
    EXPECT_EQ(part.name(), pipe);
    EXPECT_TRUE(part.Complete());
  }
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
  std::remove(pipe.c_str());
}

TEST(Convert, ObstaclesSurviveTheWire) {
  world::Obstacle o;
  o.id = 4;
  o.moving = true;
  o.center.start = 12.5;
  o.center.duration = 3.0;
  o.center.coefficients.resize(2, 3);
  o.center.coefficients << 1, 2, 3, 4, 5, 6;
  o.shape << 4, 1, 0.5, 1, 3, 0.25, 0.5, 0.25, 2;
  const int64_t origin = 1700000000000000;
  const world::Obstacle back = FromMessage(ToMessage(o, origin), origin);
  EXPECT_EQ(back.shape, o.shape);
  EXPECT_EQ(back.center.coefficients, o.center.coefficients);
  EXPECT_DOUBLE_EQ(back.center.start, 12.5);
  EXPECT_TRUE(back.moving);
}

TEST(StampOrder, TellsLateFromSetBack) {
  using Verdict = StampOrder::Verdict;
  StampOrder order;
  constexpr int64_t kSecond = 1'000'000;
  EXPECT_EQ(order.Take(10 * kSecond), Verdict::kNewer);
  EXPECT_EQ(order.Take(10 * kSecond), Verdict::kLate) << "twice the same";
  EXPECT_EQ(order.Take(8 * kSecond), Verdict::kLate) << "one stray message";
  EXPECT_EQ(order.Take(11 * kSecond), Verdict::kNewer);
  EXPECT_EQ(order.Take(11 * kSecond - 200'000), Verdict::kLate);
  EXPECT_EQ(order.Take(11 * kSecond - 100'000), Verdict::kLate) << "two that come out of order";
  EXPECT_EQ(order.Take(3 * kSecond), Verdict::kLate);
  EXPECT_EQ(order.Take(4 * kSecond), Verdict::kSetBack);
  EXPECT_EQ(order.Take(5 * kSecond), Verdict::kNewer);
}

TEST(HostClock, IsTheSameForWhoeverAsksLater) {
  const std::string file = testing::TempDir() + "/host_clock";
  std::remove(file.c_str());
  const int64_t first = HostClockOffset(file);
  std::ofstream(file) << first - 7;  // as a process from before the wall clock was set
  EXPECT_EQ(HostClockOffset(file), first - 7);
  std::ofstream(file) << "torn";
  EXPECT_NEAR(static_cast<double>(HostClockOffset(file) - first), 0.0, 1e6);
  EXPECT_NEAR(static_cast<double>(HostClockOffset("/no/such/place") - first), 0.0, 1e6);
}

}  // namespace
}  // namespace chase::bus
