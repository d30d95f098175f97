#include "services/viewer/viewer_node.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <random>

#include "chase/command_t.hpp"
#include "chase/imu_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/log_writer.h"
#include "services/viewer/commander.h"
#include "services/viewer/log_player.h"
#include "services/viewer/token_file.h"

namespace chase::viewer {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int64_t kSecond = 1000000;

template <class T>
std::vector<uint8_t> BytesOf(const T& m) {
  std::vector<uint8_t> bytes(static_cast<size_t>(m.getEncodedSize()));
  m.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// Hands over bytes at once.
class MemoryBus : public bus::Bus {
 public:
  void Deliver(const std::string& channel, const std::vector<uint8_t>& bytes) {
    const auto it = handlers_.find(channel);
    if (it != handlers_.end()) it->second(bytes.data(), bytes.size());
  }
  template <class T>
  void Deliver(const std::string& channel, const T& m) {
    Deliver(channel, BytesOf(m));
  }
  int64_t Now() const override { return now; }
  int64_t now = 100 * kSecond;

 protected:
  void SubscribeRaw(const std::string& channel, RawHandler handler) override {
    handlers_[channel] = std::move(handler);
  }
  void PublishRaw(const std::string& channel, Bytes bytes) override {
    sent[channel].push_back(std::move(bytes));
  }

 public:
  std::map<std::string, std::vector<Bytes>> sent;

 private:
  std::map<std::string, RawHandler> handlers_;
};

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

constexpr const char* kToken = "a token of the test";

/// A commander, a bus that keeps what is sent, and what was answered.
struct Desk {
  explicit Desk(const std::string& token = kToken, bool live = true)
      : commander(bus, token, live,
                  [this](const std::string& command, const std::string& refusal,
                         const std::string& words) {
                    replies.push_back(command + "|" + refusal + "|" + words);
                  }) {
    bus.SetIdentity({"viewer", "", 7});
  }
  void Ask(const std::string& text) {
    if (const auto request = ParseRequest(text); request && !request->command.empty())
      commander.Take(*request);
    Run(0.2);
  }
  void Ask(const std::string& command, const std::string& token) {
    Ask(R"({"command": ")" + command + R"(", "token": ")" + token + "\"}");
  }
  void Run(double seconds) {
    for (const int64_t end = bus.now + std::llround(seconds * 1e6); bus.now < end;) {
      bus.now += kSecond / 10;
      commander.Turn();
    }
  }
  std::vector<command_t> Sent() {
    std::vector<command_t> out;
    for (const auto& bytes : bus.sent["COMMAND"])
      out.emplace_back().decode(bytes.data(), 0, static_cast<int>(bytes.size()));
    return out;
  }
  command_ack_t AckOf(const command_t& command, bool accepted, const std::string& reason) {
    command_ack_t ack{};
    ack.command_sender = command.sender;
    ack.command_start = command.sender_start;
    ack.id = command.id;
    ack.verdict = accepted ? command_ack_t::ACCEPTED : command_ack_t::REFUSED;
    ack.reason = reason;
    return ack;
  }

  MemoryBus bus;
  std::vector<std::string> replies;
  Commander commander;
};

TEST(ViewerCommands, WithoutTheTokenNothingIsSent) {
  Desk off(""), on, playing(kToken, false);
  off.Ask("land", "");
  off.Ask("land", kToken);
  for (const std::string& token : {std::string(), std::string("a token of the tesT"),
                                   std::string(kToken) + " ", std::string("a token")})
    on.Ask("land", token);
  on.Ask("explode", kToken);
  on.Ask("Land", kToken);
  playing.Ask("land", kToken);
  std::mt19937 random(3);
  const std::string good = R"({"command": "land", "token": "a token of the tesT"})";
  for (int i = 0; i < 2000; ++i) {
    std::string text = good;
    for (int k = 0; k < 3; ++k) text[random() % text.size()] = static_cast<char>(random() % 256);
    on.Ask(text);
  }
  for (Desk* desk : {&off, &on, &playing}) {
    EXPECT_TRUE(desk->bus.sent.empty());
    EXPECT_EQ(desk->commander.taken(), 0);
  }
  EXPECT_EQ(off.replies.size(), 2U);
  EXPECT_EQ(playing.replies, std::vector<std::string>{"land|a log is played: nobody flies|"});
}

TEST(ViewerCommands, IsSentUntilItIsAnsweredAndAnsweredOnce) {
  Desk desk;
  desk.Ask("hold", kToken);
  desk.Run(0.5);
  const std::vector<command_t> sent = desk.Sent();
  ASSERT_GE(sent.size(), 5U);
  for (const command_t& m : sent) {
    EXPECT_EQ(m.kind, +command_t::HOLD);
    EXPECT_EQ(m.sender, "viewer");
    EXPECT_EQ(m.sender_start, 7);
    EXPECT_EQ(m.id, sent[0].id);
    EXPECT_EQ(m.utime, sent[0].utime);
  }
  command_ack_t other = desk.AckOf(sent[0], true, "another process's");
  other.command_sender = "command";
  desk.commander.Hear(other);
  desk.Run(0.1);
  EXPECT_TRUE(desk.replies.empty());
  for (int i = 0; i < 3; ++i) desk.commander.Hear(desk.AckOf(sent[0], true, "HOLD: as commanded"));
  desk.Run(0.1);
  desk.commander.Hear(desk.AckOf(sent[0], false, "late"));
  const size_t settled = desk.Sent().size();
  desk.Run(1.0);
  EXPECT_EQ(desk.Sent().size(), settled);
  EXPECT_EQ(desk.replies, std::vector<std::string>{"hold||HOLD: as commanded"});
  EXPECT_EQ(desk.commander.taken(), 1);
}

TEST(ViewerCommands, EachGetsItsOwnAnswer) {
  Desk desk;
  desk.Ask("takeoff", kToken);
  desk.Ask("chase", kToken);
  command_t takeoff, chase;
  for (const command_t& m : desk.Sent()) (m.kind == command_t::TAKEOFF ? takeoff : chase) = m;
  EXPECT_NE(takeoff.id, chase.id);
  desk.commander.Hear(desk.AckOf(chase, false, "it is on the ground"));
  desk.Run(0.1);
  EXPECT_EQ(desk.replies,
            std::vector<std::string>{"chase|it is on the ground|it is on the ground"});
  desk.Run(6.0);
  ASSERT_EQ(desk.replies.size(), 2U);
  EXPECT_EQ(desk.replies[1], "takeoff|no answer; does chase-mission run?|");
  for (int i = 0; i < 20; ++i)
    desk.commander.Take(*ParseRequest(R"({"command": "stop", "token": "a token of the test"})"));
  EXPECT_EQ(desk.commander.refused(), 2 + 12) << "of twenty at once eight are under way";
}

TEST(ViewerCommands, TokenFile) {
  const auto file =
      std::filesystem::temp_directory_path() / ("token_" + std::to_string(::getpid()));
  const auto read = [&](const std::string& text) {
    std::ofstream(file) << text;
    return TokenIn(file);
  };
  EXPECT_EQ(read("0123456789\n"), "0123456789");
  EXPECT_EQ(read("  with blanks \r\nmore\n"), "with blanks");
  for (const char* bad : {"", "\n0123456789", "  \n", "short\n"})
    EXPECT_THROW(read(bad), std::runtime_error) << bad;
  std::filesystem::remove(file);
  EXPECT_THROW(TokenIn(file), std::runtime_error);
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
    player->Subscribe<scan_registered_t>("SCAN_REGISTERED",
                                         [this](const scan_registered_t&) { ++scans_; });
  }

  std::filesystem::path file_;
  std::vector<double> poses_;
  int scans_ = 0;
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
  player.Survey(kSecond, [&](int64_t t) { times.push_back(t); });
  EXPECT_EQ(times, (std::vector<int64_t>{2 * kSecond, 3 * kSecond, 4 * kSecond, 5 * kSecond,
                                         6 * kSecond}));
  EXPECT_EQ(poses_.size(), 51U);
  EXPECT_EQ(scans_, 0);
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
