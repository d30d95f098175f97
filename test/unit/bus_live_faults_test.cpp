// Delays and losses of a live test flight, over LCM's UDP multicast; in a network namespace of its
// own (test/flight/in_namespace.sh).
#include <gtest/gtest.h>

#include <cstdlib>
#include <numeric>
#include <vector>

#include "chase/event_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/status_t.hpp"
#include "common/bus/udp_bus.h"
#include "common/world/fault.h"

namespace chase::bus {
namespace {

constexpr int64_t kSecond = 1000000;  // us
constexpr int64_t kLongest = 20 * kSecond;

/// The flight's monitor and whoever sends POSE.
class Sender {
 public:
  void Fault(const std::string& name, int8_t phase) {
    event_t m{};
    m.utime = bus_.Now();
    m.name = name;
    m.phase = phase;
    bus_.Publish("FAULT", m);
  }
  void Pose() {
    pose_t m{};
    m.utime = bus_.Now();
    m.orientation[0] = 1.0;
    bus_.Publish("POSE", m);
  }
  /// Returns the mark's `seq`.
  int32_t Mark() {
    status_t m{};
    m.utime = bus_.Now();
    bus_.Publish("MARK_STATUS", m);
    return marks_++;
  }

 private:
  int32_t marks_ = 0;
  UdpBus bus_{kDefaultUrl, ""};
};

/// Notes what a process hears of POSE, and since when that had been on its way.
class Receiver {
 public:
  explicit Receiver(const std::string& process) : bus(kDefaultUrl, "") {
    bus.SetIdentity({process, "", bus.Now()});
    bus.Subscribe<pose_t>("POSE", [this](const pose_t& m) {
      poses.push_back(m.seq);
      ages.push_back(bus.Now() - m.utime);
    });
    bus.Subscribe<status_t>("MARK_STATUS", [this](const status_t& m) { mark = m.seq; });
  }
  /// Handles all that has been sent by now, but what is delayed.
  void CatchUp(Sender* sender) {
    const int64_t end = bus.Now() + kLongest;
    for (const int32_t asked = sender->Mark(); mark < asked && bus.Now() < end; sender->Mark())
      bus.Handle(kSecond / 20);  // marks are lost, too, so that there are several
  }

  UdpBus bus;
  std::vector<int32_t> poses;
  std::vector<int64_t> ages;
  int32_t mark = -1;
};

class LiveFaultsTest : public ::testing::Test {
 protected:
  void SetUp() override { setenv(UdpBus::kFaultsVariable, "1", 1); }
  void TearDown() override { unsetenv(UdpBus::kFaultsVariable); }
};

int64_t DelayOf(const std::string& fault) {
  world::FaultSpec spec;
  spec.name = fault;
  return static_cast<int64_t>(1e6 * world::KindOf(spec).amount);
}

TEST_F(LiveFaultsTest, DelayedMessagesComeInTime) {
  Receiver receiver("control");
  Sender sender;
  sender.Fault("delay-POSE", event_t::BEGINS);
  for (int i = 0; i < 3; ++i) sender.Pose();
  receiver.CatchUp(&sender);
  EXPECT_TRUE(receiver.poses.empty());
  const int64_t begin = receiver.bus.Now();
  while (receiver.poses.size() < 3 && receiver.bus.Now() < begin + kLongest)
    receiver.bus.Handle(kLongest);
  EXPECT_LT(receiver.bus.Now() - begin, kLongest / 2) << "the wait ends when a message is due";
  EXPECT_EQ(receiver.poses, (std::vector<int32_t>{0, 1, 2}));
  for (const int64_t age : receiver.ages) EXPECT_GE(age, DelayOf("delay-POSE"));
}

TEST_F(LiveFaultsTest, NewerMessagesOvertakeWhenADelayEnds) {
  Receiver receiver("control");
  Sender sender;
  sender.Fault("delay-POSE", event_t::BEGINS);
  sender.Pose();
  sender.Fault("delay-POSE", event_t::ENDS);
  sender.Pose();
  const int64_t end = receiver.bus.Now() + kLongest;
  while (receiver.poses.size() < 2 && receiver.bus.Now() < end) receiver.bus.Handle(kLongest);
  EXPECT_EQ(receiver.poses, (std::vector<int32_t>{1, 0}));
}

TEST_F(LiveFaultsTest, EachProcessLosesItsShareByItsOwnDraw) {
  Receiver control("control"), planning("planning");
  setenv(UdpBus::kFaultsVariable, "2", 1);
  Receiver other("control");  // of a flight with another seed
  Sender sender;
  sender.Fault("loss-20", event_t::BEGINS);
  constexpr int kBursts = 50, kEach = 40;
  for (int burst = 0; burst < kBursts; ++burst) {
    for (int i = 0; i < kEach; ++i) sender.Pose();
    control.CatchUp(&sender);
    planning.CatchUp(&sender);
    other.CatchUp(&sender);
  }
  // The share's standard deviation is 0.9 % of 2000.
  for (const Receiver* receiver : {&control, &planning, &other})
    EXPECT_NEAR(1.0 - static_cast<double>(receiver->poses.size()) / (kBursts * kEach), 0.2, 0.04);
  EXPECT_NE(control.poses, planning.poses);
  EXPECT_NE(control.poses, other.poses);
}

TEST_F(LiveFaultsTest, NoLossEndsUnheard) {
  Receiver receiver("control");
  Sender sender;
  for (int round = 0; round < 20; ++round) {
    sender.Fault("loss-20", event_t::BEGINS);
    for (int i = 0; i < round; ++i) sender.Pose();  // the end meets another draw each time
    sender.Fault("loss-20", event_t::ENDS);
    receiver.CatchUp(&sender);
    receiver.poses.clear();
    for (int i = 0; i < 40; ++i) sender.Pose();
    receiver.CatchUp(&sender);
    ASSERT_EQ(receiver.poses.size(), 40U) << "round " << round;
  }
}

TEST_F(LiveFaultsTest, ARecordOfEverythingLosesNothing) {
  UdpBus recorder(kDefaultUrl, "");
  Sender sender;
  int64_t poses = 0;
  recorder.SubscribeEvery([&](const std::string& channel, int64_t, const uint8_t*, size_t) {
    poses += channel == "POSE" ? 1 : 0;
  });
  sender.Fault("loss-20", event_t::BEGINS);
  sender.Fault("delay-POSE", event_t::BEGINS);
  for (int i = 0; i < 100; ++i) sender.Pose();
  const int64_t end = recorder.Now() + kLongest;
  while (poses < 100 && recorder.Now() < end) recorder.Handle(DelayOf("delay-POSE") / 10);
  EXPECT_EQ(poses, 100);
}

TEST_F(LiveFaultsTest, HearingThemIsNotSaid) {
  Receiver receiver("control");
  Sender sender;
  sender.Fault("delay-POSE", event_t::BEGINS);
  receiver.CatchUp(&sender);
  EXPECT_EQ(receiver.bus.counters().count("FAULT"), 0U);
}

TEST(LiveFaults, WithoutTheVariableNothingIsDelayedOrLost) {
  unsetenv(UdpBus::kFaultsVariable);
  Receiver receiver("control");
  Sender sender;
  sender.Fault("loss-20", event_t::BEGINS);
  sender.Fault("delay-POSE", event_t::BEGINS);
  for (int i = 0; i < 100; ++i) sender.Pose();
  receiver.CatchUp(&sender);
  std::vector<int32_t> all(100);
  std::iota(all.begin(), all.end(), 0);
  EXPECT_EQ(receiver.poses, all);
}

}  // namespace
}  // namespace chase::bus
