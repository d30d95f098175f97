#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <random>
#include <set>

#include "chase/imu_t.hpp"
#include "common/bus/bus.h"
#include "common/bus/heard_order.h"
#include "common/bus/log_writer.h"
#include "common/bus/message_head.h"

namespace chase::bus {
namespace {

constexpr int64_t kStart = 1'700'000'000'000'000;  // us

/// A message on its way into a log.
struct Sent {
  int64_t stamp;  // when the recorder got it
  std::string channel;
  imu_t message;
};

/// A process "worker" that answers each SLOW, or each `every`-th, with OUT and hears FAST and OTHER
/// beside it; or, when it is ticked, with OUT at each tick.
class Flight {
 public:
  Flight(uint32_t seed, int64_t start, int every = 1, int tick_ms = 0)
      : random_(seed), start_(start), every_(every), tick_(tick_ms * int64_t{1000}) {}

  /// Runs for `seconds`; every message reaches the worker and the recorder up to 8 ms later, each
  /// by itself, in the order of its channel.
  void Run(double seconds) {
    std::vector<Sent> heard;
    for (int64_t t = 0; t < std::llround(seconds * 1e6); t += 1000) {
      if (t % 5000 == 0) Send("FAST", t, &heard);
      if (t % 40000 == 0) Send("SLOW", t, &heard);
      if (t % 70000 == 0) Send("OTHER", t, &heard);
    }
    std::stable_sort(heard.begin(), heard.end(),
                     [](const Sent& a, const Sent& b) { return a.stamp < b.stamp; });
    std::map<std::string, int32_t> newest;
    for (const Sent& m : heard) {
      for (; tick_ > 0 && m.stamp > start_ + (newest[Bus::kTick] + 1) * tick_;) {
        const int32_t n = ++newest[Bus::kTick];
        Answer(start_ + n * tick_, newest, n);
      }
      newest[m.channel] = m.message.seq;
      if (tick_ == 0 && m.channel == "SLOW" && m.message.seq % every_ == 0)
        Answer(m.stamp, newest, m.message.seq);
    }
    std::stable_sort(log_.begin(), log_.end(),
                     [](const Sent& a, const Sent& b) { return a.stamp < b.stamp; });
  }

  /// Messages that are `kept`, changed, on channels that begin with the vehicle.
  std::string Write(const std::function<bool(const Sent&)>& kept = {},
                    const std::function<void(imu_t*)>& change = {},
                    const std::string& vehicle = "") const {
    const auto file = std::filesystem::temp_directory_path() / "chase_heard_order.lcm";
    LogWriter log(file);
    for (Sent m : log_) {
      if (kept && !kept(m)) continue;
      if (change) change(&m.message);
      m.message.vehicle = vehicle;
      std::vector<uint8_t> bytes(static_cast<size_t>(m.message.getEncodedSize()));
      m.message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
      log.Write(m.stamp, vehicle + m.channel, bytes);
    }
    log.Close();
    return file;
  }

  /// What the worker had heard by each SLOW, by its seq; or by each tick.
  std::map<int32_t, std::map<std::string, int32_t>> truth;

 private:
  int64_t Delayed(const std::string& channel, int64_t t) {
    int64_t& last = last_[channel];
    return last = std::max(last + 1, start_ + t + static_cast<int64_t>(random_() % 8000));
  }
  void Send(const std::string& channel, int64_t t, std::vector<Sent>* heard) {
    imu_t m{};
    m.utime = start_ + t;
    m.seq = seqs_[channel]++;
    m.sender = "sensor";
    heard->push_back({Delayed("to worker: " + channel, t), channel, m});
    log_.push_back({Delayed("to recorder: " + channel, t), channel, m});
  }
  void Answer(int64_t t, const std::map<std::string, int32_t>& newest, int32_t to) {
    imu_t m{};
    m.utime = t;
    m.seq = seqs_["OUT"]++;
    m.sender = "worker";
    for (const auto& [channel, seq] : newest) m.inputs.push_back({channel, seq});
    m.n_inputs = static_cast<int32_t>(m.inputs.size());
    truth[to] = newest;
    log_.push_back({Delayed("to recorder: OUT", t - start_), "OUT", m});
  }

  std::mt19937 random_;
  int64_t start_;
  int every_;
  int64_t tick_;  // us; 0: never
  std::map<std::string, int64_t> last_;
  std::map<std::string, int32_t> seqs_;
  std::vector<Sent> log_;
};

/// What a node has heard by each SLOW when it hears the log in this order.
std::map<int32_t, std::map<std::string, int32_t>> Replayed(const std::string& file,
                                                           const std::vector<int64_t>& positions) {
  lcm::LogFile log(file, "r");
  std::map<int32_t, std::map<std::string, int32_t>> out;
  std::map<std::string, int32_t> newest;
  for (const int64_t position : positions) {
    fseeko(log.getFilePtr(), position, SEEK_SET);
    const lcm::LogEvent* event = log.readNextEvent();
    const auto head = HeadOf(event->data, static_cast<size_t>(event->datalen));
    newest[event->channel] = head->seq;
    if (event->channel == "SLOW") out[head->seq] = newest;
  }
  return out;
}

std::vector<int64_t> Positions(const HeardOrder& order) {
  std::vector<int64_t> positions;
  for (const HeardOrder::Event& event : order.events) positions.push_back(event.position);
  return positions;
}

const std::set<std::string> kInputs = {"FAST", "SLOW", "OTHER"};

TEST(HeardOrder, IsTheProcessesAndNotTheRecorders) {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    Flight flight(seed, kStart);
    flight.Run(20.0);
    const std::string file = flight.Write();
    const HeardOrder order = OrderHeard(file, "worker", kInputs);
    EXPECT_TRUE(order.Sentences().empty()) << order.Sentences().front();
    std::vector<int64_t> sorted = Positions(order);
    EXPECT_EQ(Replayed(file, sorted), flight.truth) << "seed " << seed;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(std::unique(sorted.begin(), sorted.end()), sorted.end()) << "handed over twice";
    EXPECT_EQ(sorted.size(), 4000u + 500u + 286u);
    EXPECT_NE(Replayed(file, sorted), flight.truth) << "the file's order would have done";
  }
}

TEST(HeardOrder, ARarerChannelBesideTheOneThatIsAnswered) {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    Flight flight(seed, kStart, 4);  // two or three OTHER beside four SLOW
    flight.Run(20.0);
    const std::string file = flight.Write();
    auto replayed = Replayed(file, Positions(OrderHeard(file, "worker", kInputs)));
    for (const auto& [slow, newest] : flight.truth)
      EXPECT_EQ(replayed[slow], newest) << "seed " << seed << ", SLOW " << slow;
  }
}

/// Of a process that is ticked every 100 ms and sends OUT then, not when it hears SLOW.
TEST(HeardOrder, TicksStandWhereTheyWere) {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    Flight flight(seed, kStart, 1, 100);
    flight.Run(20.0);
    const std::string file = flight.Write();
    const HeardOrder order = OrderHeard(file, "worker", kInputs);
    ASSERT_TRUE(order.has_ticks);
    lcm::LogFile log(file, "r");
    std::map<std::string, int32_t> newest;
    int32_t ticks = 0;
    for (const auto& [position, utime] : order.events) {
      if (position >= 0) {
        fseeko(log.getFilePtr(), position, SEEK_SET);
        const lcm::LogEvent* event = log.readNextEvent();
        newest[event->channel] = HeadOf(event->data, static_cast<size_t>(event->datalen))->seq;
        continue;
      }
      newest[Bus::kTick] = ++ticks;
      EXPECT_EQ(newest, flight.truth.at(ticks)) << "seed " << seed << ", tick " << ticks;
      EXPECT_NEAR(1e-6 * static_cast<double>(utime - kStart), 0.1 * ticks, 0.009);
    }
    EXPECT_EQ(static_cast<size_t>(ticks), flight.truth.size());
  }
}

TEST(HeardOrder, TellsWhatTheLogLacks) {
  Flight flight(7, kStart);
  flight.Run(20.0);
  const std::string file = flight.Write([](const Sent& m) {
    return m.channel != "FAST" || m.message.seq < 1000 || m.message.seq >= 1030;
  });
  const HeardOrder order = OrderHeard(file, "worker", kInputs);
  ASSERT_EQ(order.missing.size(), 1u);
  const auto& fast = order.missing.at("FAST");
  EXPECT_EQ(fast.count, 30);
  EXPECT_NEAR(static_cast<double>(fast.of), 4000.0, 15.0);
  EXPECT_NEAR(1e-6 * static_cast<double>(fast.first_utime - kStart), 5.0, 0.06);
  EXPECT_NE(order.Sentences().front().find("FAST: 30 of"), std::string::npos);
}

TEST(HeardOrder, TellsOfAChannelThatTheLogLacksAltogether) {
  for (const int64_t start : {kStart, int64_t{1'000'000}}) {  // live, and in lockstep
    Flight flight(7, start);
    flight.Run(20.0);
    const std::string file = flight.Write([](const Sent& m) { return m.channel != "OTHER"; });
    const HeardOrder order = OrderHeard(file, "worker", kInputs);
    ASSERT_EQ(order.missing.size(), 1u);
    const auto& other = order.missing.at("OTHER");
    EXPECT_NEAR(static_cast<double>(other.of), 286.0, 2.0);
    EXPECT_EQ(other.count, other.of);
    EXPECT_LT(1e-6 * static_cast<double>(other.first_utime - start), 0.2);
    EXPECT_TRUE(OrderHeard(file, "worker", {"FAST", "SLOW"}).missing.empty()) << "nobody asks";
  }
}

TEST(HeardOrder, OfAVehicleWithAPrefixIsTheSame) {
  Flight flight(3, kStart);
  flight.Run(20.0);
  const std::string file = flight.Write({}, {}, "falcon_");
  EXPECT_TRUE(OrderHeard(file, "worker", kInputs, "eagle_").events.empty());
  EXPECT_EQ(Positions(OrderHeard(file, "worker", kInputs, "falcon_")).size(), 4000u + 500u + 286u);
}

/// The one sentence about a log whose messages are `kept` and changed; "worker" is replayed.
std::string SentenceOf(const Flight& flight, const std::function<bool(const Sent&)>& kept,
                       const std::function<void(imu_t*)>& change) {
  const HeardOrder order = OrderHeard(flight.Write(kept, change), "worker", kInputs);
  EXPECT_TRUE(order.events.empty());
  const auto lines = order.Sentences();
  EXPECT_LE(lines.size(), 1u);
  return lines.empty() ? "" : lines.front();
}

TEST(HeardOrder, ALiveLogThatDoesNotTellItIsHeardAsRecordedAndThatIsSaid) {
  const auto anew = [](const std::string& who) {
    return [who](imu_t* m) { m->sender_start = m->sender == who && m->seq >= 100 ? 2 : 1; };
  };
  const auto no_outputs = [](const Sent& m) { return m.channel != "OUT"; };
  const std::string follows =
      ", so that the log does not tell in which order worker heard its inputs; they are replayed "
      "in the order in which they were recorded; the replay's answers may differ from the flight's";
  Flight live(1, kStart), lockstep(1, 1'000'000);
  live.Run(20.0);
  lockstep.Run(20.0);
  EXPECT_EQ(SentenceOf(live, {}, anew("worker")), "worker was started anew in this log" + follows);
  EXPECT_EQ(SentenceOf(live, {}, anew("sensor")),
            "the sender of FAST was started anew in this log" + follows);
  EXPECT_EQ(SentenceOf(live, no_outputs, {}), "the log holds nothing that worker sent" + follows);
  EXPECT_EQ(SentenceOf(lockstep, {}, anew("worker")), "") << "in the right order already";
}

TEST(HeardOrder, LogicalTimeOtherProcessesAndTwoLivesAreTakenAsTheyStand) {
  Flight lockstep(1, 1'000'000), live(1, kStart);
  lockstep.Run(2.0);
  live.Run(2.0);
  EXPECT_TRUE(OrderHeard(lockstep.Write(), "worker", kInputs).events.empty());
  EXPECT_TRUE(OrderHeard(live.Write(), "nobody", kInputs).events.empty());
  EXPECT_FALSE(OrderHeard(live.Write(), "worker", kInputs).events.empty());
  EXPECT_THROW(OrderHeard("no/such.lcm", "worker", kInputs), std::runtime_error);
}

}  // namespace
}  // namespace chase::bus
