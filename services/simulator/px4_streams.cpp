// What the autopilot sends by itself, and how often.
#include <algorithm>
#include <cmath>

#include "common/mavlink/frames.h"
#include "services/simulator/battery.h"
#include "services/simulator/px4.h"

namespace chase::simulator {
namespace {

namespace mav = mavlink::mav;

constexpr double kMostId = 0xFFFFFF;  // of a MAVLink 2 message
constexpr int64_t kNone = 0;          // us: the stream does not run

uint8_t Code(mav::MavResult r) { return static_cast<uint8_t>(r); }

}  // namespace

/// All that it can send: on a companion link before anything is asked for, us.
const std::map<uint32_t, int64_t>& Px4::DefaultIntervals() {
  static const std::map<uint32_t, int64_t> intervals = {{mav::Heartbeat::kId, 1'000'000},
                                                        {mav::HighresImu::kId, 20'000},
                                                        {mav::AttitudeQuaternion::kId, 20'000},
                                                        {mav::LocalPositionNed::kId, 100'000},
                                                        {mav::ExtendedSysState::kId, 1'000'000},
                                                        {mav::SysStatus::kId, 1'000'000},
                                                        {mav::BatteryStatus::kId, kNone},
                                                        {mav::Timesync::kId, 100'000},
                                                        {mav::RcChannels::kId, kNone}};
  return intervals;
}

// mavlink.io, MAV_CMD_SET_MESSAGE_INTERVAL: us; -1 ends the stream, 0 asks for the default rate.
// PX4 fails for the heartbeat, and for what it has no stream of (without a receiver: RC_CHANNELS).
uint8_t Px4::SetInterval(const mav::CommandLong& m) {
  const auto number = static_cast<double>(m.param1), interval = static_cast<double>(m.param2);
  const bool sound = number >= 0.0 && number <= kMostId && interval <= INT32_MAX &&
                     (interval >= 0.0 || interval == -1.0);  // all false for NaN
  if (!sound) return Code(mav::MavResult::DENIED);
  const auto usual = DefaultIntervals().find(static_cast<uint32_t>(number));
  if (usual == DefaultIntervals().end() || usual->first == mav::Heartbeat::kId ||
      (usual->first == mav::RcChannels::kId && !HasReceiver()))
    return Code(mav::MavResult::FAILED);
  int64_t& now = intervals_[usual->first];
  now = interval < 0.0    ? kNone
        : interval == 0.0 ? usual->second
                          : std::max<int64_t>(1, static_cast<int64_t>(interval));
  next_.erase(usual->first);
  seen_.rates[usual->first] = now == kNone ? 0.0 : 1e6 / static_cast<double>(now);
  return Code(mav::MavResult::ACCEPTED);
}

// mavlink.io, MAV_CMD_REQUEST_MESSAGE: the heartbeat as well. What is sent by itself keeps its
// times.
uint8_t Px4::SendOnce(float id) {
  for (const auto& [known, interval] : intervals_)
    if (static_cast<float>(known) == id && interval != kNone) {
      asked_for_.insert(known);
      return Code(mav::MavResult::ACCEPTED);
    }
  return Code(mav::MavResult::DENIED);
}

bool Px4::Due(uint32_t id) {
  if (asked_for_.erase(id) > 0) return true;
  const int64_t interval = intervals_.at(id);
  int64_t& next = next_[id];
  if (interval == kNone || now_ < next) return false;
  next = std::max(next + interval, now_ - interval);
  return true;
}

void Px4::Stream(int64_t clock) {
  const int64_t own = Clock(now_);
  const auto ms = static_cast<uint32_t>(own / 1000);
  if (Due(mav::Timesync::kId)) Send(mav::Timesync{0, 1000 * Clock(clock), 0, 0});
  if (Due(mav::HighresImu::kId)) {
    const Eigen::Vector3f f = mavlink::SwapBody(body_.accel).cast<float>();
    const Eigen::Vector3f w = mavlink::SwapBody(body_.gyro).cast<float>();
    mav::HighresImu m;
    m.time_usec = static_cast<uint64_t>(own);
    m.xacc = f.x(), m.yacc = f.y(), m.zacc = f.z();
    m.xgyro = w.x(), m.ygyro = w.y(), m.zgyro = w.z();
    m.fields_updated = 0x3F;
    Send(m);
  }
  if (Due(mav::AttitudeQuaternion::kId)) {
    const Eigen::Quaternionf q = mavlink::SwapFrames(body_.R_WB).cast<float>();
    mav::AttitudeQuaternion m;
    m.time_boot_ms = ms;
    m.q1 = q.w(), m.q2 = q.x(), m.q3 = q.y(), m.q4 = q.z();
    Send(m);
  }
  if (Due(mav::LocalPositionNed::kId)) {
    const Eigen::Vector3f p = mavlink::SwapWorld(body_.p_WB).cast<float>();
    const Eigen::Vector3f v = mavlink::SwapWorld(body_.v_WB).cast<float>();
    Send(mav::LocalPositionNed{ms, p.x(), p.y(), p.z(), v.x(), v.y(), v.z()});
  }
  StreamState();
}

void Px4::StreamState() {
  if (Due(mav::Heartbeat::kId)) {
    const auto state = killed_      ? mav::MavState::FLIGHT_TERMINATION
                       : !armed_    ? mav::MavState::STANDBY
                       : failsafe() ? mav::MavState::CRITICAL
                                    : mav::MavState::ACTIVE;
    mav::Heartbeat m;
    m.type = static_cast<uint8_t>(mav::MavType::QUADROTOR);
    m.autopilot = static_cast<uint8_t>(options_.autopilot);
    m.custom_mode = mode_.custom_mode();
    m.base_mode = static_cast<uint8_t>(1 | (armed_ ? 128 : 0));
    m.system_status = static_cast<uint8_t>(state);
    m.mavlink_version = 3;
    Send(m);
  }
  if (Due(mav::ExtendedSysState::kId))
    Send(mav::ExtendedSysState{0, static_cast<uint8_t>(landed_ ? 1 : 2)});
  const auto percent = static_cast<int8_t>(std::floor(100.0 * body_.charge + 1e-9));
  if (Due(mav::SysStatus::kId)) {
    mav::SysStatus m;
    m.voltage_battery = static_cast<uint16_t>(1e3 * RestVolts(body_.charge));
    m.battery_remaining = percent;
    Send(m);
  }
  if (HasReceiver() && Due(mav::RcChannels::kId)) {
    mav::RcChannels m;
    if (options_.transmitter) {
      m.chancount = 8;
      m.chan1_raw = m.chan2_raw = m.chan3_raw = m.chan4_raw = 1500;
      m.rssi = 100;
    }
    Send(m);
  }
  if (Due(mav::BatteryStatus::kId)) {
    mav::BatteryStatus m;
    m.voltages.fill(UINT16_MAX);  // BAT1_N_CELLS 0: the whole pack in the first cell's place
    m.voltages[0] = static_cast<uint16_t>(1e3 * RestVolts(body_.charge));
    m.battery_remaining = percent;
    Send(m);
  }
}

}  // namespace chase::simulator
