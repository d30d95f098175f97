#include <gtest/gtest.h>

#include <map>
#include <set>

#include "common/world/random.h"
#include "services/fcu/autopilot.h"
#include "services/fcu/clock_sync.h"
#include "services/fcu/imu_stream.h"
#include "services/fcu/status_text.h"
#include "services/fcu/stream_rates.h"

namespace chase::fcu {
namespace {

constexpr int64_t kStart = 1'700'000'000'000'000;

/// Exponential queues on the way there and back, of these means in us, on top of 300 us each way.
struct Link {
  world::Random random;
  double there, back;
  int64_t Delay(double mean) {
    return 300 + static_cast<int64_t>(-mean * std::log(1.0 - random.Uniform()));
  }
};

// 100 us/s of drift is twice what two crystals do.
TEST(FcuClockSync, ErrsByLittleWithDriftAndQueues) {
  for (double mean : {50.0, 500.0, 3000.0}) {
    Link link{world::Random{1}, mean, mean};
    ClockSync sync;
    double worst = 0;
    for (int64_t t = 0; t < 60'000'000; t += 100'000) {
      const auto remote = [&](int64_t at) { return 5'000'000 + at + at / 10'000; };
      const int64_t arrived = t + link.Delay(link.there);
      const int64_t back = arrived + link.Delay(link.back);
      sync.Add(kStart + t, remote(arrived), kStart + back);
      if (t < 4'000'000) continue;
      worst =
          std::max(worst, std::abs(static_cast<double>(*sync.HostTime(remote(t)) - kStart - t)));
    }
    EXPECT_LT(worst, 400 + 0.5 * mean) << "us, queues of " << mean;
    EXPECT_GT(sync.jitter(), 0.0);
    EXPECT_LT(sync.jitter(), 1e-6 * (200 + mean));
    EXPECT_EQ(sync.restarts(), 0);
  }
}

TEST(FcuClockSync, OutliersDoNotMoveIt) {
  world::Random random(2);
  ClockSync sync;
  for (int i = 0; i < 600; ++i) {
    const int64_t t = kStart + 100'000 * i;
    const int64_t off = random.Next() % 10 == 0 && i > 20 ? 500'000 : 0;  // answers that lie
    sync.Add(t, t - kStart + 500 + off, t + 1000);
  }
  EXPECT_NEAR(static_cast<double>(*sync.HostTime(0) - kStart), 0.0, 10.0);
  EXPECT_EQ(sync.restarts(), 0);
}

TEST(FcuClockSync, AClockThatBeginsAnewIsFollowed) {
  ClockSync sync;
  int64_t t = kStart;
  for (int i = 0; i < 50; ++i, t += 100'000) sync.Add(t, t - kStart + 90'000'000, t + 1000);
  const int64_t reboot = t;
  for (int i = 0; i < 20; ++i, t += 100'000) sync.Add(t, t - reboot, t + 1000);
  EXPECT_EQ(sync.restarts(), 1);
  EXPECT_NEAR(static_cast<double>(*sync.HostTime(0) - reboot), 500.0, 10.0);
}

TEST(FcuClockSync, NeedsTripsAndRefusesImpossibleOnes) {
  ClockSync sync;
  EXPECT_FALSE(sync.HostTime(0));
  for (int i = 0; i < 50; ++i) sync.Add(kStart, 0, kStart - 1);
  for (int i = 0; i < 50; ++i) sync.Add(kStart, 0, kStart + 2'000'000);
  EXPECT_FALSE(sync.synced());
}

TEST(FcuStreamRates, AsksUntilMessagesComeAndNoLonger) {
  StreamRates rates(200.0);
  int asked = 0, last = 0;
  std::map<uint32_t, double> granted;
  for (int64_t t = 1'000'000; t < 60'000'000; t += 5'000) {
    if (const auto request = rates.Tick(t)) {
      ++asked;
      last = static_cast<int>(t / 1'000'000);
      EXPECT_EQ(request->command, 511);
      const auto id = static_cast<uint32_t>(request->param1);
      if (id == mav::RcChannels::kId) {
        rates.OnAnswer(4);
      } else {
        rates.OnAnswer(0);
        if (t > 20'000'000) granted[id] = request->param2;  // before that it accepts and forgets
      }
    }
    for (const auto& [id, interval] : granted)
      if (t % static_cast<int64_t>(interval) < 5'000) rates.OnMessage(id);
  }
  EXPECT_EQ(granted.size(), 7u);
  EXPECT_EQ(granted.count(mav::BatteryStatus::kId), 1u);
  EXPECT_NEAR(granted.at(mav::HighresImu::kId), 5000.0, 1.0);
  EXPECT_EQ(rates.missing().find("HIGHRES_IMU"), std::string::npos) << rates.missing();
  EXPECT_LT(last, 30) << "asked on though all comes";
  EXPECT_GT(asked, 20);
}

TEST(FcuStreamRates, AsksForAnotherImuWhereTheBestIsRefused) {
  for (const uint32_t last : {mav::RawImu::kId, mav::ScaledImu::kId, mav::HighresImu::kId}) {
    StreamRates rates(200.0);
    std::set<uint32_t> asked;
    for (int64_t t = 1'000'000; t < 40'000'000; t += 5'000) {
      if (const auto request = rates.Tick(t)) {
        const auto id = static_cast<uint32_t>(request->param1);
        asked.insert(id);
        const bool imu =
            id == mav::RawImu::kId || id == mav::ScaledImu::kId || id == mav::HighresImu::kId;
        rates.OnAnswer(!imu || id == last ? 0 : 4);
      }
      if (asked.count(last) != 0) rates.OnMessage(last);
      rates.OnMessage(mav::AttitudeQuaternion::kId);
      rates.OnMessage(mav::ExtendedSysState::kId);
    }
    EXPECT_NEAR(rates.imu_rate(), 200.0, 2.0) << last;
    EXPECT_EQ(rates.missing(), "") << last;
    EXPECT_EQ(asked.count(mav::RawImu::kId), last == mav::HighresImu::kId ? 0u : 1u);
    EXPECT_EQ(asked.count(mav::ScaledImu::kId), last == mav::ScaledImu::kId ? 1u : 0u);
  }
}

TEST(FcuStreamRates, TellsWhatIsRefusedFromWhatIsLost) {
  StreamRates rates(200.0);
  for (int64_t t = 1'000'000; t < 20'000'000; t += 5'000)
    if (const auto request = rates.Tick(t))
      rates.OnAnswer(static_cast<uint32_t>(request->param1) == mav::ExtendedSysState::kId ? 4 : 0);
  EXPECT_EQ(rates.missing(),
            "HIGHRES_IMU at 0.0 of 200 Hz, ATTITUDE_QUATERNION at 0.0 of 50 Hz, "
            "EXTENDED_SYS_STATE at 0.0 of 5 Hz (refused)");
}

mav::Statustext Chunk(const std::string& text, uint16_t id, uint8_t seq) {
  mav::Statustext m;
  m.severity = 2, m.id = id, m.chunk_seq = seq;
  std::copy(text.begin(), text.end(), m.text.begin());
  return m;
}

TEST(FcuStatusTexts, JoinsChunksAndShowsGaps) {
  StatusTexts texts;
  const std::string fifty(50, 'a');
  EXPECT_EQ(texts.Add(0, Chunk("whole", 0, 0))->text, "whole");
  EXPECT_FALSE(texts.Add(0, Chunk(fifty, 7, 0)));
  EXPECT_FALSE(texts.Add(0, Chunk(std::string(50, 'x'), 8, 0))) << "another in between";
  EXPECT_EQ(texts.Add(0, Chunk("end", 7, 1))->text, fifty + "end");
  EXPECT_EQ(texts.Add(0, Chunk("end", 8, 2))->text, std::string(50, 'x') + "...end");
  EXPECT_FALSE(texts.Add(0, Chunk(fifty, 9, 0)));
  EXPECT_EQ(texts.Add(0, Chunk("", 9, 1))->text, fifty) << "an exact fit ends with an empty chunk";
  EXPECT_EQ(texts.Add(0, Chunk("a\nb\x80", 0, 0))->text, "a b");
}

template <class M>
Frame FrameOf(const M& message, uint8_t system = 1, uint8_t component = 1) {
  Frame frame;
  frame.system = system, frame.component = component, frame.id = M::kId;
  frame.payload = mavlink::ToPayload(message);
  return frame;
}

TEST(FcuImuStream, TheBestSourceSpeaksAndStampsRise) {
  ClockSync clock;
  ImuStream imu;
  mav::HighresImu high;
  high.fields_updated = 0x3F;
  EXPECT_FALSE(imu.Take(FrameOf(high), clock, kStart)) << "no clock yet";
  for (int i = 0; i < 10; ++i) clock.Add(kStart, 500, kStart + 1000);  // offset: kStart
  mav::ScaledImu scaled;
  int from_scaled = 0, from_high = 0;
  int64_t last = 0;
  for (int64_t t = 1'000'000; t < 4'000'000; t += 5'000) {
    high.time_usec = static_cast<uint64_t>(t);
    scaled.time_boot_ms = static_cast<uint32_t>(t / 1000);
    if (t < 3'000'000)
      if (const auto s = imu.Take(FrameOf(high), clock, kStart + t)) {
        EXPECT_EQ(s->utime, kStart + t);
        EXPECT_GT(s->utime, last);
        last = s->utime, ++from_high;
      }
    if (const auto s = imu.Take(FrameOf(scaled), clock, kStart + t)) {
      EXPECT_GT(s->utime, last);
      last = s->utime, ++from_scaled;
    }
  }
  EXPECT_EQ(from_high, 400);
  EXPECT_EQ(from_scaled, 101) << "half a second after HIGHRES_IMU has ceased";
  EXPECT_STREQ(imu.source(), "SCALED_IMU");
  EXPECT_FALSE(imu.Take(FrameOf(high), clock, kStart + 9'000'000)) << "an old stamp";
}

TEST(FcuAutopilot, ListensToOnePx4Only) {
  Autopilot autopilot(0);
  mav::Heartbeat m;
  m.autopilot = 3;  // ArduPilot
  EXPECT_FALSE(autopilot.Take(FrameOf(m, 1), kStart));
  EXPECT_NE(autopilot.stranger(), "");
  m.autopilot = 12, m.base_mode = 0x81, m.custom_mode = 4u << 16 | 5u << 24, m.system_status = 5;
  EXPECT_FALSE(autopilot.Take(FrameOf(m, 2, 190), kStart)) << "a ground station's component";
  EXPECT_TRUE(autopilot.Take(FrameOf(m, 2), kStart));
  EXPECT_EQ(autopilot.stranger(), "") << "the PX4 has spoken since";
  EXPECT_EQ(autopilot.system(), 2);
  EXPECT_TRUE(autopilot.armed());
  EXPECT_TRUE(autopilot.failsafe());
  EXPECT_EQ(autopilot.mode().name(), "AUTO.RTL");
  m.base_mode = 1;
  EXPECT_FALSE(autopilot.Take(FrameOf(m, 3), kStart)) << "another vehicle";
  EXPECT_TRUE(autopilot.armed());
}

void Say(Autopilot* autopilot, const std::string& text, int64_t utime) {
  mav::Statustext t;
  t.severity = 2;
  std::copy(text.begin(), text.end(), t.text.begin());
  autopilot->Take(FrameOf(t), utime);
}

TEST(FcuAutopilot, RemembersTheLastChecksThatFailedUntilItIsArmed) {
  Autopilot autopilot(0);
  mav::Heartbeat m;
  m.autopilot = 12;
  autopilot.Take(FrameOf(m), kStart);
  for (const char* check : {"a", "b", "c", "d", "b", "e"})
    Say(&autopilot, std::string("Preflight Fail: ") + check + "\t", kStart);
  Say(&autopilot, "Arming denied: Resolve system health failures", kStart + 60'000'000);
  EXPECT_EQ(autopilot.Warning(kStart + 61'000'000, 10.0),
            "Arming denied: Resolve system health failures, Preflight Fail: c, "
            "Preflight Fail: d, Preflight Fail: b, Preflight Fail: e");
  m.base_mode = 0x80;
  autopilot.Take(FrameOf(m), kStart + 62'000'000);
  EXPECT_EQ(autopilot.Warning(kStart + 90'000'000, 10.0), "");
}

TEST(FcuAutopilot, RemembersTheFirstTextsOfThoseSaidTogether) {
  Autopilot autopilot(0);
  mav::Heartbeat m;
  m.autopilot = 12, m.base_mode = 0x80;
  autopilot.Take(FrameOf(m), kStart);
  const auto said = [&](int64_t utime) { return autopilot.Warning(utime, 10.0); };
  int64_t t = kStart;
  for (const char* text : {"Low battery", "Failsafe activated", "Low battery", "RTL", "Landing"})
    Say(&autopilot, text, t += 200'000);
  EXPECT_EQ(said(t), "Low battery, Failsafe activated, RTL") << "the cause comes first";
  for (const char* text : {"a", "b", "c", "d"}) Say(&autopilot, text, t += 900'000);
  EXPECT_EQ(said(t), "c, d") << "what is said later is of another cause";
  EXPECT_EQ(said(t + 9'000'000), "c, d");
  EXPECT_EQ(said(t + 11'000'000), "");
}

/// One that is heard.
Autopilot Heard() {
  Autopilot autopilot(0);
  mav::Heartbeat heartbeat;
  heartbeat.autopilot = 12;
  autopilot.Take(FrameOf(heartbeat), kStart);
  return autopilot;
}

bool Says(const Autopilot& autopilot, double seconds, const char* what) {
  return autopilot.Words(kStart + static_cast<int64_t>(1e6 * seconds)).find(what) !=
         std::string::npos;
}

// SYS_STATUS is of the emptiest of all batteries, BATTERY_STATUS of each.
TEST(FcuAutopilot, TheBatteryIsTheEmptiestOneAndNoOlderThanItSays) {
  Autopilot autopilot = Heard();
  EXPECT_FALSE(Says(autopilot, 0.0, "battery"));
  mav::SysStatus all;
  all.voltage_battery = 14'800;
  all.battery_remaining = 30;
  autopilot.Take(FrameOf(all), kStart);
  mav::BatteryStatus first;
  first.battery_remaining = 80;
  autopilot.Take(FrameOf(first), kStart);
  EXPECT_TRUE(Says(autopilot, 0.0, ", battery 30 % 14.8 V"));
  EXPECT_TRUE(Says(autopilot, 2.0, ", battery 30 %"));
  EXPECT_FALSE(Says(autopilot, 3.0, "battery")) << autopilot.Words(kStart + 3'000'000);
  EXPECT_FALSE(Says(autopilot, 3.0, " V"));
  autopilot.Take(FrameOf(all), kStart + 4'000'000);
  EXPECT_TRUE(Says(autopilot, 4.0, ", battery 30 %"));
  all.voltage_battery = UINT16_MAX;
  all.battery_remaining = -1;
  autopilot.Take(FrameOf(all), kStart + 4'500'000);
  EXPECT_FALSE(Says(autopilot, 4.5, "battery")) << "none is connected";
}

TEST(FcuAutopilot, TheBatteryIsKnownByItsOwnMessageToo) {
  Autopilot autopilot = Heard();
  mav::SysStatus all;
  all.battery_remaining = -1;
  autopilot.Take(FrameOf(all), kStart);
  mav::BatteryStatus battery;
  battery.battery_remaining = -1;
  autopilot.Take(FrameOf(battery), kStart);
  EXPECT_FALSE(Says(autopilot, 0.0, "battery"));
  battery.battery_remaining = 60;
  battery.voltages.fill(UINT16_MAX);
  battery.voltages[0] = battery.voltages[1] = 3'850;
  autopilot.Take(FrameOf(battery), kStart + 1'000'000);
  EXPECT_TRUE(Says(autopilot, 1.0, ", battery 60 % 7.7 V"));
  battery.voltages.fill(3'850);
  battery.voltages_ext = {3'850, 3'850, 0, UINT16_MAX};  // the last two are none
  autopilot.Take(FrameOf(battery), kStart + 1'000'000);
  EXPECT_TRUE(Says(autopilot, 1.0, ", battery 60 % 46.2 V")) << "twelve cells";
  battery.id = 1;
  battery.battery_remaining = 50;
  autopilot.Take(FrameOf(battery), kStart + 2'000'000);
  EXPECT_TRUE(Says(autopilot, 2.0, ", battery 50 %")) << "the emptier of two";
  autopilot.Take(FrameOf(all), kStart + 3'000'000);
  EXPECT_TRUE(Says(autopilot, 3.0, ", battery 50 %")) << "SYS_STATUS does not know";
  EXPECT_FALSE(Says(autopilot, 5.0, "battery"));
}

TEST(FcuAutopilot, AReceiverIsHeardNoLongerThanItSpeaks) {
  Autopilot autopilot = Heard();
  EXPECT_FALSE(Says(autopilot, 0.0, "receiver"));
  mav::RcChannels channels;
  channels.chancount = 8;
  autopilot.Take(FrameOf(channels), kStart);
  EXPECT_TRUE(Says(autopilot, 2.0, ", receiver heard"));
  EXPECT_TRUE(Says(autopilot, 3.0, ", no receiver")) << autopilot.Words(kStart + 3'000'000);
  autopilot.Take(FrameOf(channels), kStart + 4'000'000);
  EXPECT_TRUE(Says(autopilot, 4.0, ", receiver heard"));
  channels.chancount = 0;
  autopilot.Take(FrameOf(channels), kStart + 4'000'000);
  EXPECT_TRUE(Says(autopilot, 4.0, ", no receiver"));
}

TEST(FcuAutopilot, StandsNoLongerThanItSaysSo) {
  Autopilot autopilot(0);
  mav::Heartbeat heartbeat;
  heartbeat.autopilot = 12;
  autopilot.Take(FrameOf(heartbeat, 1), kStart);
  mav::ExtendedSysState state;
  state.landed_state = static_cast<uint8_t>(mav::MavLandedState::ON_GROUND);
  autopilot.Take(FrameOf(state, 1), kStart);
  EXPECT_TRUE(autopilot.on_ground(kStart + 2'000'000));
  EXPECT_FALSE(autopilot.on_ground(kStart + 3'000'000));
  EXPECT_NE(autopilot.Words(kStart + 2'000'000).find(", on ground"), std::string::npos);
  EXPECT_NE(autopilot.Words(kStart + 3'000'000).find(", unknown"), std::string::npos);
}

}  // namespace
}  // namespace chase::fcu
