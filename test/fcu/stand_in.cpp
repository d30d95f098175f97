#include "stand_in.h"

#include <algorithm>
#include <cmath>

#include "services/fcu/frames.h"

namespace chase::fcu::testing {
namespace {

constexpr int64_t kBoot = 12'345'678;  // us
constexpr double kGravity = 9.81;
constexpr double kAttitudeLag = 0.15;  // s
constexpr Mode kPosition{3, 0}, kHold{4, 3};

double Seconds(int64_t from, int64_t to) { return 1e-6 * static_cast<double>(to - from); }
uint8_t Code(mav::MavResult r) { return static_cast<uint8_t>(r); }

}  // namespace

StandIn::StandIn(const StandInOptions& options, int64_t utime, uint64_t seed)
    : options_(options),
      random_(seed),
      version_2_(!options.starts_in_version_1),
      boot_(utime - kBoot),
      now_(utime),
      last_tick_(utime) {
  // Rates of a companion link before anything is asked for.
  intervals_ = {{mav::Heartbeat::kId, 1'000'000},
                {mav::HighresImu::kId, 20'000},
                {mav::AttitudeQuaternion::kId, 20'000},
                {mav::LocalPositionNed::kId, 100'000},
                {mav::ExtendedSysState::kId, 1'000'000},
                {mav::SysStatus::kId, 1'000'000},
                {mav::Timesync::kId, 100'000}};
}

int64_t StandIn::Clock(int64_t utime) const {
  const int64_t since = utime - boot_;
  return since + static_cast<int64_t>(1e-6 * options_.drift_ppm * static_cast<double>(since));
}

template <class M>
void StandIn::Send(const M& message) {
  if (version_2_ || M::kId > 255) {
    outgoing_.push_back(writer_.Write(now_, message));
    return;
  }
  const Payload payload = ToPayload(message);  // MAVLink 1: whole, without extensions
  Bytes frame(6 + M::kBaseLength);
  frame[0] = 0xFE;
  frame[1] = static_cast<uint8_t>(M::kBaseLength);
  frame[2] = sequence_1_++, frame[3] = 1, frame[4] = 1, frame[5] = static_cast<uint8_t>(M::kId);
  std::copy_n(payload.bytes.begin(), M::kBaseLength, frame.begin() + 6);
  const uint16_t crc =
      FrameChecksum(frame.data() + 1, frame.size() - 1, ChecksumExtra(M::kId).value());
  frame.push_back(static_cast<uint8_t>(crc));
  frame.push_back(static_cast<uint8_t>(crc >> 8));
  outgoing_.push_back(frame);
}

void StandIn::Say(const std::string& text, uint8_t severity) {
  mav::Statustext m;
  m.severity = severity;
  m.id = text.size() > m.text.size() ? static_cast<uint16_t>(1 + random_.Next() % 65535) : 0;
  for (std::size_t at = 0; at == 0 || at < text.size(); at += m.text.size()) {
    m.text.fill('\0');
    std::copy_n(text.begin() + static_cast<std::ptrdiff_t>(at),
                std::min(m.text.size(), text.size() - at), m.text.begin());
    Send(m);
    ++m.chunk_seq;
  }
}

void StandIn::Receive(int64_t utime, const Bytes& bytes) {
  now_ = std::max(now_, utime);
  reader_.Add(utime, bytes.data(), bytes.size(), [this](const Frame& f) { OnFrame(f); });
  reader_.Reset();
}

void StandIn::OnFrame(const Frame& frame) {
  if (frame.version == 2) version_2_ = true;
  if (As<mav::Heartbeat>(frame)) ++seen_.heartbeats;
  if (const auto m = As<mav::CommandLong>(frame)) OnCommand(*m, frame.system, frame.component);
  if (const auto m = As<mav::Odometry>(frame)) {
    ++seen_.odometry;
    seen_.vision = *m;
    if (m->estimator_type == 7) Say("ODOMETRY: estimator_type 7 unsupported", 2);
  }
  if (const auto m = As<mav::Timesync>(frame)) {
    ++seen_.timesync;
    const int64_t clock = Clock(now_) * 1000;
    if (m->tc1 == 0) return Send(mav::Timesync{clock, m->ts1, 0, 0});
    const int64_t offset_us = (m->ts1 / 1000 + clock / 1000 - 2 * (m->tc1 / 1000)) / 2;
    seen_.clock_errors.push_back(1e-6 * static_cast<double>(offset_us - (Clock(now_) - now_)));
  }
  const auto m = As<mav::SetAttitudeTarget>(frame);
  if (!m || (m->target_system != 1 && m->target_system != 0)) return;
  ++seen_.setpoints;
  if (!(mode_ == kOffboardMode)) ++seen_.setpoints_while_not_offboard;
  if (Seconds(last_setpoint_, now_) > 0.5) first_setpoint_ = now_;  // below 2 Hz: it begins anew
  last_setpoint_ = now_;
  seen_.setpoint = *m;
}

bool StandIn::StreamAlive() const {
  return last_setpoint_ != 0 && Seconds(last_setpoint_, now_) <= options_.com_of_loss_t;
}

bool StandIn::Streamed() const { return StreamAlive() && Seconds(first_setpoint_, now_) >= 1.0; }

void StandIn::OnCommand(const mav::CommandLong& m, uint8_t from_system, uint8_t from_component) {
  if (m.target_system != 1 || m.target_component != 1) return;
  ++seen_.commands;
  mav::CommandAck ack;
  ack.command = m.command;
  ack.result = Handle(m);
  ack.target_system = from_system;
  ack.target_component = from_component;
  if (random_.Uniform() >= options_.lost_acks) Send(ack);
}

uint8_t StandIn::Handle(const mav::CommandLong& m) {
  switch (static_cast<mav::MavCmd>(m.command)) {
    case mav::MavCmd::DO_SET_MODE:
      return SetMode({static_cast<uint8_t>(m.param2), static_cast<uint8_t>(m.param3)});
    case mav::MavCmd::COMPONENT_ARM_DISARM:
      return Arm(m.param1 > 0.5f);
    case mav::MavCmd::SET_MESSAGE_INTERVAL: {
      const auto id = static_cast<uint32_t>(m.param1);
      if (id == mav::RcChannels::kId) return Code(mav::MavResult::FAILED);  // it has none
      intervals_[id] = static_cast<int64_t>(m.param2);
      seen_.rates[id] = 1e6 / static_cast<double>(m.param2);
      return Code(mav::MavResult::ACCEPTED);
    }
  }
  return Code(mav::MavResult::UNSUPPORTED);
}

// The switch succeeds without a stream while disarmed: arming is what is then refused.
uint8_t StandIn::SetMode(Mode mode) {
  if (mode == kOffboardMode) {
    ++seen_.offboard_commands;
    if (options_.refuses_offboard) return Code(mav::MavResult::DENIED);
    if (armed_ && !Streamed()) {
      Say("Switching to mode 'Offboard' is currently not possible: no offboard signal", 4);
      return Code(mav::MavResult::TEMPORARILY_REJECTED);
    }
  }
  mode_ = intended_ = mode;
  failsafe_ = false;
  return Code(mav::MavResult::ACCEPTED);
}

uint8_t StandIn::Arm(bool on) {
  if (on == armed_) return Code(mav::MavResult::ACCEPTED);
  if (!on) {
    if (!landed_) {
      Say("Disarming denied: not landed", 2);
      return Code(mav::MavResult::TEMPORARILY_REJECTED);
    }
    armed_ = false;
    return Code(mav::MavResult::ACCEPTED);
  }
  if (options_.refuses_to_arm) return Code(mav::MavResult::DENIED);
  const std::string problem = !options_.preflight.empty()             ? options_.preflight
                              : mode_ == kOffboardMode && !Streamed() ? "no offboard signal"
                                                                      : "";
  if (!problem.empty()) {
    Say("Arming denied: " + problem, 2);
    return Code(mav::MavResult::TEMPORARILY_REJECTED);
  }
  armed_ = true;
  has_flown_ = false;
  ++seen_.times_armed;
  return Code(mav::MavResult::ACCEPTED);
}

void StandIn::PilotMode(Mode mode) {
  mode_ = intended_ = mode;
  failsafe_ = false;
}

void StandIn::Reboot(int64_t utime) {
  boot_ = utime;
  mode_ = intended_ = kPosition;
  armed_ = failsafe_ = false;
  first_setpoint_ = last_setpoint_ = 0;
  version_2_ = !options_.starts_in_version_1;
  writer_ = FrameWriter(1, 1);
  next_.clear();
  p_.z() = 0.0;
  v_.setZero();
}

void StandIn::Rules() {
  if (armed_ && intended_ == kOffboardMode) {
    const bool lost = !StreamAlive();
    if (lost && !failsafe_) Say("No offboard signal, failsafe", 1);
    failsafe_ = lost;  // it returns by itself when the stream does
    mode_ = !lost ? kOffboardMode : options_.loss_lands ? kLandMode : kHold;
  }
  if (!armed_) failsafe_ = false;
  const bool still = p_.z() <= 0.01 && force_.norm() < kGravity;
  if (!still) down_since_ = now_;
  landed_ = !armed_ || Seconds(down_since_, now_) > 0.5;
  if (!landed_) landed_since_ = now_, has_flown_ = has_flown_ || p_.z() > 0.1;
  if (armed_ && landed_ && has_flown_ && Seconds(landed_since_, now_) > options_.com_disarm_land)
    armed_ = false;
}

/// A point that is pushed along its own z axis; the autopilot's own modes hold or sink.
void StandIn::Move(double dt) {
  Eigen::Quaterniond wanted = R_;
  Eigen::Vector3d a = Eigen::Vector3d::Zero();
  double push = 0.0;  // over mass
  if (armed_ && mode_ == kOffboardMode && seen_.setpoint) {
    const auto& q = seen_.setpoint->q;
    if ((seen_.setpoint->type_mask & 128) == 0)
      wanted = SwapFrames(Eigen::Quaterniond(q[0], q[1], q[2], q[3]));
    push = kGravity * static_cast<double>(seen_.setpoint->thrust) / options_.hover;
  } else if (armed_) {
    wanted = Eigen::Quaterniond::Identity();
    const double speed = mode_ == kLandMode ? -0.7 : 0.0;
    push = p_.z() <= 0.0 && mode_ == kLandMode ? 0.0 : kGravity + 2.0 * (speed - v_.z());
  }
  const Eigen::Quaterniond before = R_;
  R_ = R_.slerp(std::min(1.0, dt / kAttitudeLag), wanted);
  const Eigen::Quaterniond step = before.conjugate() * R_;
  w_ = 2.0 / dt * (step.w() < 0.0 ? -1.0 : 1.0) * step.vec();
  force_ = R_ * Eigen::Vector3d(0, 0, push) - 0.3 * v_;
  a = force_ - Eigen::Vector3d(0, 0, kGravity);
  v_ += a * dt;
  p_ += v_ * dt;
  if (p_.z() < 0.0 || (p_.z() == 0.0 && v_.z() < 0.0)) p_.z() = 0.0, v_.setZero();
}

void StandIn::Tick(int64_t utime) {
  now_ = std::max(now_, utime);
  const double dt = Seconds(last_tick_, now_);
  last_tick_ = now_;
  if (dt > 0.0) Move(std::min(dt, 0.02));
  Rules();
  Stream();
}

void StandIn::Stream() {
  const auto due = [this](uint32_t id) {
    const auto interval = intervals_.find(id);
    if (interval == intervals_.end()) return false;
    int64_t& next = next_[id];
    if (now_ < next) return false;
    next = std::max(next + interval->second, now_ - interval->second);
    return true;
  };
  const auto clock = static_cast<uint64_t>(Clock(now_));
  const auto ms = static_cast<uint32_t>(clock / 1000);
  const Eigen::Quaterniond q = SwapFrames(R_);
  const Eigen::Vector3f p = SwapWorld(p_).cast<float>(), v = SwapWorld(v_).cast<float>();
  if (due(mav::Heartbeat::kId)) {
    mav::Heartbeat m;
    m.type = 2;
    m.autopilot = static_cast<uint8_t>(options_.autopilot);
    m.custom_mode = static_cast<uint32_t>(mode_.main << 16 | mode_.sub << 24);
    m.base_mode = static_cast<uint8_t>(1 | (armed_ ? 128 : 0));
    m.system_status = static_cast<uint8_t>(!armed_ ? 3 : failsafe_ ? 5 : 4);
    m.mavlink_version = 3;
    Send(m);
  }
  if (due(mav::Timesync::kId)) Send(mav::Timesync{0, static_cast<int64_t>(clock) * 1000, 0, 0});
  if (due(mav::HighresImu::kId)) {
    const bool held = p_.z() <= 0.0 && v_.isZero();
    const Eigen::Vector3d force = held ? Eigen::Vector3d(0, 0, kGravity) : force_;
    const Eigen::Vector3f f = SwapBody(R_.conjugate() * force).cast<float>();
    const Eigen::Vector3f w = SwapBody(w_).cast<float>();
    mav::HighresImu m;
    m.time_usec = clock;
    m.xacc = f.x(), m.yacc = f.y(), m.zacc = f.z();
    m.xgyro = w.x(), m.ygyro = w.y(), m.zgyro = w.z();
    m.fields_updated = 0x3F;
    Send(m);
  }
  if (due(mav::AttitudeQuaternion::kId)) {
    mav::AttitudeQuaternion m;
    m.time_boot_ms = ms;
    m.q1 = static_cast<float>(q.w()), m.q2 = static_cast<float>(q.x());
    m.q3 = static_cast<float>(q.y()), m.q4 = static_cast<float>(q.z());
    Send(m);
  }
  if (due(mav::LocalPositionNed::kId))
    Send(mav::LocalPositionNed{ms, p.x(), p.y(), p.z(), v.x(), v.y(), v.z()});
  if (due(mav::ExtendedSysState::kId))
    Send(mav::ExtendedSysState{0, static_cast<uint8_t>(landed_ ? 1 : 2)});
  if (due(mav::SysStatus::kId)) {
    mav::SysStatus m;
    m.voltage_battery = 15800;
    m.battery_remaining = 80;
    Send(m);
  }
  if (due(mav::BatteryStatus::kId)) {
    mav::BatteryStatus m;
    m.battery_remaining = 80;
    Send(m);
  }
}

std::vector<StandIn::Bytes> StandIn::TakeOutgoing() { return std::exchange(outgoing_, {}); }

}  // namespace chase::fcu::testing
