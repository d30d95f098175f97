#include "services/simulator/px4.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/math/rotation.h"
#include "common/mavlink/frames.h"

namespace chase::simulator {
namespace {

using Eigen::Vector3d;
using mavlink::Mode;
namespace mav = mavlink::mav;

constexpr double kLatest = 1e17;          // us, 3000 years: stamps beyond are none
constexpr int64_t kBoot = 12'345'678;     // us
constexpr double kStreamBefore = 1.0;     // s of setpoints before OFFBOARD
constexpr double kSlowest = 0.5;          // s between setpoints of a stream: 2 Hz
constexpr float kForce = 21196.0f;        // param2 of arming and disarming
constexpr int64_t kOffsetMemory = 8;      // answers of TIMESYNC over which the offset is averaged
constexpr int64_t kLongestTrip = 10'000;  // us; answers that took longer are no measure
constexpr int kSettled = 500;             // answers until a stamp is believed

/// The setpoint with no rates and no rotation where its mask leaves them out.
mav::SetAttitudeTarget Heeded(mav::SetAttitudeTarget m) {
  using Mask = mav::AttitudeTargetTypemask;
  const auto ignored = [&](Mask bit) { return (m.type_mask & static_cast<uint8_t>(bit)) != 0; };
  if (ignored(Mask::BODY_ROLL_RATE_IGNORE)) m.body_roll_rate = 0.0f;
  if (ignored(Mask::BODY_PITCH_RATE_IGNORE)) m.body_pitch_rate = 0.0f;
  if (ignored(Mask::BODY_YAW_RATE_IGNORE)) m.body_yaw_rate = 0.0f;
  if (ignored(Mask::ATTITUDE_IGNORE)) m.q = {1.0f, 0.0f, 0.0f, 0.0f};
  return m;
}

template <class... Numbers>
bool Finite(Numbers... numbers) {
  return (std::isfinite(numbers) && ...);
}

/// To unit length; false where it is not finite or farther from that than the bus takes.
bool Normalise(std::array<float, 4>* q) {
  Eigen::Map<Eigen::Vector4f> v(q->data());
  if (!(std::abs(v.squaredNorm() - 1.0f) < 1e-2f)) return false;
  v.normalize();
  return true;
}

/// One of those that it flies, a pilot's with the sticks let go; none for anything else, NaN and a
/// mode that is not said to be PX4's own (MAV_MODE_FLAG_CUSTOM_MODE_ENABLED) as well.
std::optional<Mode> ModeOf(const mav::CommandLong& m) {
  if (!(std::fmod(m.param1, 2.0f) >= 1.0f)) return std::nullopt;
  for (const Mode& mode : {mavlink::kOffboardMode, mavlink::kLandMode, mavlink::kHoldMode,
                           mavlink::kPositionMode, Mode{1, 0}, Mode{2, 0}, Mode{5, 0}, Mode{7, 0}})
    if (m.param2 == mode.main && m.param3 == mode.sub) return mode;
  return std::nullopt;
}

/// mavlink_receiver.cpp, handle_message_odometry.
bool TakesEstimator(uint8_t type) {
  using Type = mav::MavEstimatorType;
  switch (static_cast<Type>(type)) {
    case Type::UNKNOWN:
    case Type::NAIVE:
    case Type::VISION:
    case Type::VIO:
    case Type::MOCAP:
      return true;
    default:
      return false;
  }
}

/// Along a frame's own axes to those of one with z down; none: PX4 does not know the frame.
std::optional<Eigen::Vector3f> Downwards(uint8_t frame, const Eigen::Vector3f& v) {
  switch (static_cast<mav::MavFrame>(frame)) {
    case mav::MavFrame::LOCAL_NED:
    case mav::MavFrame::LOCAL_FRD:
      return v;
    case mav::MavFrame::LOCAL_ENU:
      return Eigen::Vector3f(v.y(), v.x(), -v.z());
    case mav::MavFrame::LOCAL_FLU:
      return Eigen::Vector3f(v.x(), -v.y(), -v.z());
    default:
      return std::nullopt;
  }
}

bool IsOfBody(uint8_t frame) {
  using Frame = mav::MavFrame;
  const auto f = static_cast<Frame>(frame);
  return f == Frame::BODY_FRD || f == Frame::BODY_NED || f == Frame::BODY_OFFSET_NED;
}

/// Position in LOCAL_FRD and velocity in BODY_FRD, NaN where PX4 does not know the velocity's
/// frame; false without a position. As PX4 does it: the rotation stays what it is in any frame.
bool ToNed(mav::Odometry* m) {
  const auto p = Downwards(m->frame_id, {m->x, m->y, m->z});
  if (!p || !p->allFinite()) return false;
  m->x = p->x(), m->y = p->y(), m->z = p->z();
  if (IsOfBody(m->child_frame_id)) return true;
  const auto v = Downwards(m->child_frame_id, {m->vx, m->vy, m->vz});
  const Eigen::Quaternionf q(m->q[0], m->q[1], m->q[2], m->q[3]);
  const Eigen::Vector3f in_body =
      v ? q.conjugate() * *v : Eigen::Vector3f(Eigen::Vector3f::Constant(NAN));
  m->vx = in_body.x(), m->vy = in_body.y(), m->vz = in_body.z();
  return true;
}

double Seconds(int64_t from, int64_t to) { return 1e-6 * static_cast<double>(to - from); }
uint8_t Code(mav::MavResult r) { return static_cast<uint8_t>(r); }

}  // namespace

Px4::Px4(const Px4Options& options, int64_t utime, uint64_t seed)
    : options_(options),
      random_(seed),
      version_2_(!options.starts_in_version_1),
      boot_(utime - kBoot),
      now_(utime),
      mode_(mavlink::kPositionMode),
      intended_(mavlink::kPositionMode),
      landed_since_(utime),
      armed_since_(utime),
      killed_since_(utime),
      intervals_(DefaultIntervals()) {}

int64_t Px4::Clock(int64_t utime) const {
  const int64_t since = utime - boot_;
  return since + static_cast<int64_t>(1e-6 * options_.drift_ppm * static_cast<double>(since));
}

std::optional<int64_t> Px4::HostTime(uint64_t companion_us) const {
  const auto offset = offsets_.find(vision_sender_);
  if (offset == offsets_.end() || static_cast<double>(companion_us) > kLatest) return std::nullopt;
  if (offset->second.answers < kSettled) return now_;
  const auto own = static_cast<double>(static_cast<int64_t>(companion_us) - offset->second.us);
  return boot_ + static_cast<int64_t>(own / (1.0 + 1e-6 * options_.drift_ppm));
}

/// A frame of MAVLink 1: whole, without extensions.
Px4::Bytes Px4::InVersion1(uint32_t id, std::size_t length, const mavlink::Payload& payload) {
  Bytes frame(6 + length);
  frame[0] = 0xFE;
  frame[1] = static_cast<uint8_t>(length);
  frame[2] = sequence_1_++, frame[3] = 1, frame[4] = 1, frame[5] = static_cast<uint8_t>(id);
  std::copy_n(payload.bytes.begin(), length, frame.begin() + 6);
  const uint16_t crc = mavlink::FrameChecksum(frame.data() + 1, frame.size() - 1,
                                              mavlink::ChecksumExtra(id).value());
  frame.push_back(static_cast<uint8_t>(crc));
  frame.push_back(static_cast<uint8_t>(crc >> 8));
  return frame;
}

void Px4::Say(const std::string& text, uint8_t severity) {
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

void Px4::Receive(int64_t arrival, int64_t clock, const Bytes& bytes) {
  reader_.Add(clock, bytes.data(), bytes.size(),
              [&](const mavlink::Frame& frame) { OnFrame(frame, arrival, clock); });
  reader_.Reset();
}

void Px4::OnFrame(const mavlink::Frame& frame, int64_t arrival, int64_t clock) {
  if (frame.version == 2) version_2_ = true;
  if (mavlink::As<mav::Heartbeat>(frame)) ++seen_.heartbeats;
  if (const auto m = mavlink::As<mav::CommandLong>(frame)) OnCommand(*m, frame);
  if (const auto m = mavlink::As<mav::Odometry>(frame)) OnOdometry(*m, SenderOf(frame));
  if (const auto m = mavlink::As<mav::Timesync>(frame))
    OnTimesync(*m, SenderOf(frame), arrival, clock);
  if (const auto m = mavlink::As<mav::SetAttitudeTarget>(frame)) OnSetpoint(*m, arrival);
}

// Velocities and covariances may be NaN, which says that they are not known. A frame that PX4 does
// not know leaves the position or the velocity out.
void Px4::OnOdometry(mav::Odometry m, Sender sender) {
  if (!TakesEstimator(m.estimator_type))
    return Say("ODOMETRY: estimator_type " + std::to_string(m.estimator_type) + " unsupported", 2);
  if (options_.ekf2_ev_qmin > 0 && m.quality < options_.ekf2_ev_qmin) return;
  if (!Normalise(&m.q) || !ToNed(&m)) return;
  ++seen_.odometry;
  seen_.vision = m;
  vision_sender_ = sender;
}

void Px4::OnSetpoint(const mav::SetAttitudeTarget& message, int64_t arrival) {
  if (message.target_system != 1 && message.target_system != 0) return;
  mav::SetAttitudeTarget m = Heeded(message);
  if (!Normalise(&m.q) || !Finite(m.body_roll_rate, m.body_pitch_rate, m.body_yaw_rate, m.thrust))
    return;
  ++seen_.setpoints;
  if (!(mode_ == mavlink::kOffboardMode)) ++seen_.setpoints_while_not_offboard;
  if (Seconds(last_setpoint_, now_) > kSlowest) first_setpoint_ = now_;
  last_setpoint_ = now_;
  if (flown_by_)
    seen_.longest_setpoint_gap = std::max(seen_.longest_setpoint_gap, Seconds(*flown_by_, arrival));
  if (IsLed()) flown_by_ = arrival;
  seen_.setpoint = m;
}

// Each peer has a clock of its own: vision's stamps are of the one that sends it.
void Px4::OnTimesync(const mav::Timesync& m, Sender sender, int64_t arrival, int64_t clock) {
  ++seen_.timesync;
  if (m.tc1 == 0) return Send(mav::Timesync{1000 * Clock(clock), m.ts1, 0, 0});
  const int64_t own = Clock(arrival);
  if (own - m.ts1 / 1000 >= kLongestTrip) return;
  const int64_t offset = m.tc1 / 1000 - (m.ts1 / 1000 + own) / 2;
  seen_.clock_errors.push_back(1e-6 * static_cast<double>((arrival - own) - offset));
  Offset& known = offsets_.emplace(sender, Offset{offset}).first->second;
  if (std::llabs(offset - known.us) > 100'000) known = {offset};
  known.us += (offset - known.us) / kOffsetMemory;
  ++known.answers;
}

bool Px4::StreamAlive() const {
  return last_setpoint_ != 0 && Seconds(last_setpoint_, now_) <= options_.com_of_loss_t;
}

bool Px4::Streamed() const {
  return StreamAlive() && Seconds(first_setpoint_, now_) >= kStreamBefore;
}

void Px4::OnCommand(const mav::CommandLong& m, const mavlink::Frame& frame) {
  if (m.target_system != 1 || m.target_component != 1) return;
  ++seen_.commands;
  mav::CommandAck ack;
  ack.command = m.command;
  ack.result = Handle(m);
  ack.target_system = frame.system;
  ack.target_component = frame.component;
  if (random_.Uniform() >= options_.lost_acks) Send(ack);
}

uint8_t Px4::Handle(const mav::CommandLong& m) {
  switch (static_cast<mav::MavCmd>(m.command)) {
    case mav::MavCmd::DO_SET_MODE:
      return SetMode(ModeOf(m));
    case mav::MavCmd::RUN_PREARM_CHECKS:
      said_.clear();
      return Code(mav::MavResult::ACCEPTED);
    case mav::MavCmd::NAV_LAND:
      return SetMode(mavlink::kLandMode);
    case mav::MavCmd::COMPONENT_ARM_DISARM:
      return Arm(m.param1 > 0.5f, m.param2 == kForce);
    case mav::MavCmd::SET_MESSAGE_INTERVAL:
      return SetInterval(m);
    case mav::MavCmd::REQUEST_MESSAGE:
      return SendOnce(m.param1);
  }
  return Code(mav::MavResult::UNSUPPORTED);
}

// The switch succeeds without a stream while disarmed: arming is what is then refused.
uint8_t Px4::SetMode(std::optional<Mode> mode) {
  if (!mode) return Code(mav::MavResult::DENIED);
  if (*mode == mavlink::kOffboardMode) {
    ++seen_.offboard_commands;
    if (options_.refuses_offboard) return Code(mav::MavResult::DENIED);
    if (armed_ && !Streamed()) {
      Say("Switching to mode 'Offboard' is currently not possible: no offboard signal", 4);
      return Code(mav::MavResult::TEMPORARILY_REJECTED);
    }
  }
  if (*mode == mavlink::kLandMode && options_.refuses_to_land) return Code(mav::MavResult::DENIED);
  Enter(*mode);
  return Code(mav::MavResult::ACCEPTED);
}

void Px4::Enter(Mode mode, bool failsafe) {
  mode_ = intended_ = mode;
  in_failsafe_ = failsafe;
  own_mode_ = OwnMode(body_);
}

// Disarming by force heeds nothing; from outside arming by force is arming.
uint8_t Px4::Arm(bool on, bool forced) {
  if (on == armed_) return Code(mav::MavResult::ACCEPTED);
  if (!on) {
    if (!landed_ && !forced) {
      Say("Disarming denied: not landed", 2);
      return Code(mav::MavResult::TEMPORARILY_REJECTED);
    }
    armed_ = false;
    return Code(mav::MavResult::ACCEPTED);
  }
  if (options_.refuses_to_arm) return Code(mav::MavResult::DENIED);
  if (!Health().empty()) {
    Say("Arming denied: Resolve system health failures first", 2);
    return Code(mav::MavResult::TEMPORARILY_REJECTED);
  }
  armed_ = true;
  has_flown_ = drained_ = false;
  ++seen_.times_armed;
  return Code(mav::MavResult::ACCEPTED);
}

void Px4::Reboot(int64_t utime) {
  boot_ = utime;
  mode_ = intended_ = mavlink::kPositionMode;
  armed_ = false;
  land_detector_ = {};
  first_setpoint_ = last_setpoint_ = 0;
  flown_by_.reset();
  version_2_ = !options_.starts_in_version_1;
  writer_ = mavlink::FrameWriter(1, 1);
  next_.clear();
  intervals_ = DefaultIntervals();
  seen_.rates.clear();
  offsets_.clear();
  vision_sender_ = {};
}

void Px4::Tick(int64_t utime, int64_t clock, const Px4Body& body) {
  now_ = std::max(now_, utime);
  body_ = body;
  if (!own_mode_.Holds(body)) own_mode_ = OwnMode(body);
  WatchHealth();
  WatchStream();
  WatchTransmitter();
  WatchBattery();
  WatchKill();
  WatchLanding();
  if (!IsLed()) flown_by_.reset();
  Stream(clock);
}

AttitudeSetpoint Px4::Demand(const Px4Body& body) const {
  AttitudeSetpoint off;
  off.motors = false;
  if (!armed_ || killed_) return off;
  return mode_ == mavlink::kOffboardMode && seen_.setpoint
             ? OffboardDemand(body)
             : own_mode_.Demand(body, mode_ == mavlink::kLandMode);
}

AttitudeSetpoint Px4::OffboardDemand(const Px4Body& body) const {
  const mav::SetAttitudeTarget& m = *seen_.setpoint;
  AttitudeSetpoint demand;
  demand.thrust = kGravity * std::clamp(static_cast<double>(m.thrust), 0.0, 1.0) / options_.hover;
  const auto ignored = static_cast<uint8_t>(mav::AttitudeTargetTypemask::ATTITUDE_IGNORE);
  if ((m.type_mask & ignored) != 0) {  // body rates: no attitude error is left to mend
    demand.orientation = body.R_WB;
    demand.body_rate = mavlink::SwapBody({m.body_roll_rate, m.body_pitch_rate, m.body_yaw_rate});
    return demand;
  }
  demand.orientation = mavlink::SwapFrames(Eigen::Quaterniond(m.q[0], m.q[1], m.q[2], m.q[3]));
  // The rate of yaw counts about the vertical of the earth frame.
  demand.body_rate =
      demand.orientation.conjugate() * mavlink::SwapWorld({0.0, 0.0, m.body_yaw_rate});
  return demand;
}

std::vector<Px4::Bytes> Px4::TakeOutgoing() { return std::exchange(outgoing_, {}); }

}  // namespace chase::simulator
