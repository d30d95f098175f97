// The host's wall clock is set while its processes run, over LCM's UDP multicast; in a network
// namespace of its own (test/flight/in_namespace.sh).
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <vector>

#include "chase/pose_t.hpp"
#include "common/bus/host_clock.h"
#include "common/bus/udp_bus.h"
#include "test/flight/wall_clock.h"

namespace chase::bus {
namespace {

constexpr int64_t kSecond = 1'000'000;  // us

/// Sets the wall clock as the steps before have left it.
void Step(int64_t by) {
  static int64_t all = 0;
  static ChaseClockStep* next = ChaseClockSteps();
  *next++ = {WallMicroseconds() - all, by};
  all += by;
}

void Send(UdpBus* bus, int n) {
  pose_t m{};
  m.utime = bus->Now();
  m.orientation[0] = 1.0;
  for (int i = 0; i < n; ++i) bus->Publish("POSE", m);
}

void CatchUp(UdpBus* bus, const std::vector<int64_t>& heard, size_t n) {
  const int64_t end = bus->Now() + 20 * kSecond;
  while (heard.size() < n && bus->Now() < end) bus->Handle(kSecond / 100);
  ASSERT_EQ(heard.size(), n);
}

TEST(ClockStep, TheHostsClockKnowsOfNone) {
  UdpBus before(kDefaultUrl, "");
  for (const int64_t by : {3600 * kSecond, -7200 * kSecond, 5 * kSecond}) {
    const int64_t wall = WallMicroseconds(), now = before.Now();
    Step(by);
    EXPECT_NEAR(static_cast<double>(WallMicroseconds() - wall - by), 0.0, 1e6);
    EXPECT_NEAR(static_cast<double>(before.Now() - now), 0.0, 1e6);
    UdpBus after(kDefaultUrl, "");
    EXPECT_NEAR(static_cast<double>(after.Now() - before.Now()), 0.0, 1e6) << "it came up since";
  }
}

TEST(ClockStep, IsNoticedForAsLongAsItIsAskedAfter) {
  WallClockWatch watch;
  EXPECT_FALSE(watch.WasSet(kSecond));
  for (const int64_t by : {kSecond / 50, -kSecond / 50, 3600 * kSecond}) {
    Step(by);
    EXPECT_TRUE(watch.WasSet(kSecond));
    usleep(20'000);
    EXPECT_FALSE(watch.WasSet(10'000));
  }
}

// A message waits with the stamp of the clock that was.
TEST(ClockStep, ARecordGoesOnInOrder) {
  for (const int64_t by : {5 * kSecond, -5 * kSecond, 3600 * kSecond, -3600 * kSecond}) {
    UdpBus recorder(kDefaultUrl, ""), sender(kDefaultUrl, "");
    std::vector<int64_t> heard;
    recorder.SubscribeEvery([&](const std::string& channel, int64_t utime, const uint8_t*, size_t) {
      if (channel == "POSE") heard.push_back(utime);
    });
    const int64_t begin = sender.Now();
    Send(&sender, 1);
    CatchUp(&recorder, heard, 1);
    Send(&sender, 5);
    usleep(50'000);
    Step(by);
    CatchUp(&recorder, heard, 6);
    Send(&sender, 5);
    CatchUp(&recorder, heard, 11);
    EXPECT_TRUE(std::is_sorted(heard.begin(), heard.end())) << by;
    EXPECT_GE(heard.front(), begin);
    EXPECT_LE(heard.back(), sender.Now());
  }
}

}  // namespace
}  // namespace chase::bus
