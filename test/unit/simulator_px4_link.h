#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "common/mavlink/framing.h"
#include "services/simulator/px4.h"

namespace chase::simulator::testing {

namespace mav = mavlink::mav;

inline constexpr int64_t kStart = 1'700'000'000'000'000;  // us

/// The autopilot and those who write to it.
class Link {
 public:
  Link() : px4_(Options(), kStart, 1) {}

  template <class M>
  void Send(const M& message, uint8_t system = 1, uint8_t component = 191) {
    mavlink::FrameWriter writer(system, component);
    px4_.Receive(now_, now_, writer.Write(now_, message));
  }

  /// Setpoints that arrive every `period` us and are looked at every 20 ms.
  void Setpoints(int count, int64_t period, float thrust = 0.0f) {
    mav::SetAttitudeTarget m;
    m.q = {1.0f, 0.0f, 0.0f, 0.0f};
    m.target_system = 1;
    m.thrust = thrust;
    mavlink::FrameWriter writer(1, 191);
    for (int i = 0; i < count; ++i) {
      const int64_t arrival = now_ += period;
      const int64_t clock = (arrival / 20'000 + 1) * 20'000;
      px4_.Tick(clock, clock, {});
      px4_.Receive(arrival, clock, writer.Write(now_, m));
    }
  }

  /// Messages of each type that it sends in a second.
  std::map<uint32_t, int> Second() { return Seconds(1.0); }
  std::map<uint32_t, int> Seconds(double seconds) {
    std::map<uint32_t, int> count;
    mavlink::FrameReader reader;
    for (int i = 0; i < static_cast<int>(400.0 * seconds); ++i, now_ += 2'500) {
      px4_.Tick(now_, now_, body);
      for (const auto& bytes : px4_.TakeOutgoing())
        reader.Add(now_, bytes.data(), bytes.size(), [&](const mavlink::Frame& f) {
          ++count[f.id];
          if (const auto m = mavlink::As<mav::Heartbeat>(f))
            status_ = static_cast<mav::MavState>(m->system_status);
          if (const auto m = mavlink::As<mav::RcChannels>(f)) channels_ = m->chancount;
          if (const auto m = mavlink::As<mav::BatteryStatus>(f)) battery_ = *m;
          if (const auto m = mavlink::As<mav::CommandAck>(f))
            result_ = static_cast<mav::MavResult>(m->result);
        });
    }
    return count;
  }

  /// The answer to a command; none: there was none.
  std::optional<mav::MavResult> Command(mav::MavCmd command, float p1, float p2, float p3 = 0.0f) {
    return Ordered(command, p1, p2, p3, 1.0);
  }
  /// The same at once, between two setpoints.
  std::optional<mav::MavResult> Order(mav::MavCmd command, float p1, float p2) {
    return Ordered(command, p1, p2, 0.0f, 0.01);
  }
  std::optional<mav::MavResult> Ask(float id, float interval) {
    return Command(mav::MavCmd::SET_MESSAGE_INTERVAL, id, interval);
  }

  /// A companion whose clock is `ahead` us of the host's answers to TIMESYNC.
  void Answer(uint8_t system, uint8_t component, int64_t ahead, int answers = 500) {
    for (int i = 0; i < answers; ++i)
      Send(mav::Timesync{1000 * (now_ + ahead), 1000 * px4_.Clock(now_), 0, 0}, system, component);
  }

  /// What its last heartbeat says of itself, a moment from now.
  mav::MavState Status() {
    Second();
    return status_;
  }
  /// A pilot flies it, hovering at rest.
  void Fly() {
    body.p_WB.z() = 1.0;
    body.touches = false;
    body.thrust = body.hover_thrust;
    px4_.PilotMode(mavlink::kPositionMode);
    px4_.PilotArms(true);
  }
  /// The channels of a receiver that it told last.
  int channels() const { return channels_; }
  /// BATTERY_STATUS that it told last.
  const mav::BatteryStatus& battery() const { return battery_; }

  Px4& px4() { return px4_; }
  int64_t now() const { return now_; }

  Px4Body body;

 private:
  std::optional<mav::MavResult> Ordered(mav::MavCmd command, float p1, float p2, float p3,
                                        double seconds) {
    mav::CommandLong m;
    m.command = static_cast<uint16_t>(command);
    m.target_system = m.target_component = 1;
    m.param1 = p1, m.param2 = p2, m.param3 = p3;
    result_.reset();
    Send(m);
    Seconds(seconds);
    return result_;
  }
  static Px4Options Options() {
    Px4Options options;
    options.starts_in_version_1 = false;
    return options;
  }

  Px4 px4_;
  int64_t now_ = kStart;
  int channels_ = -1;
  mav::BatteryStatus battery_;
  mav::MavState status_{};
  std::optional<mav::MavResult> result_;
};

}  // namespace chase::simulator::testing
