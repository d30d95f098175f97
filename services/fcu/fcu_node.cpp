#include "services/fcu/fcu_node.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <stdexcept>

#include "chase/flight_state_t.hpp"
#include "chase/imu_t.hpp"
#include "common/bus/command_call.h"
#include "common/bus/convert.h"
#include "common/world/ages.h"

namespace chase::fcu {
namespace {

/// 64 hexadecimal digits; what is no digit between them is passed over.
std::optional<Key> LoadKey(const std::string& file) {
  if (file.empty()) return std::nullopt;
  std::ifstream in(file);
  std::string digits;
  for (char c = 0; in.get(c);)
    if (std::isxdigit(static_cast<unsigned char>(c)) != 0) digits += c;
  Key key{};
  if (digits.size() != 2 * key.size())
    throw std::runtime_error("signing_key_file " + file + " does not hold 64 hexadecimal digits; " +
                             "make one with: openssl rand -hex 32");
  for (std::size_t i = 0; i < key.size(); ++i)
    key[i] = static_cast<uint8_t>(std::stoi(digits.substr(2 * i, 2), nullptr, 16));
  return key;
}

Pose FromMessage(const pose_t& m) {
  Pose pose;
  pose.utime = m.utime;
  pose.p_WB = bus::ToVector(m.pos);
  pose.v_WB = bus::ToVector(m.vel);
  pose.R_WB = bus::ToQuaternion(m.orientation).normalized();
  pose.w_WB_B = bus::ToVector(m.rotation_rate);
  // What has drifted since the start is no matter to PX4, whose frame drifts along.
  pose.covariance =
      Eigen::Map<const Eigen::Matrix<double, 9, 9, Eigen::RowMajor>>(m.local_covariance);
  pose.epoch = m.epoch;
  pose.usable = m.health == pose_t::HEALTH_OK || m.health == pose_t::HEALTH_DEGRADED;
  pose.degraded = m.health == pose_t::HEALTH_DEGRADED;
  pose.starting = m.health == pose_t::HEALTH_STARTING;
  return pose;
}

Setpoint FromMessage(const attitude_setpoint_t& m) {
  Setpoint setpoint;
  setpoint.R_WB = bus::ToQuaternion(m.orientation).normalized();
  setpoint.w_WB_B = bus::ToVector(m.body_rate);
  setpoint.thrust = m.thrust;
  setpoint.motors = m.motors == attitude_setpoint_t::MOTORS_ON;
  return setpoint;
}

}  // namespace

FcuNode::FcuNode(bus::Bus& bus, const FcuConfig& config)
    : bus_(bus),
      config_(config),
      bridge_(config, LoadKey(config.signing_key_file)),
      transport_(OpenTransport(config.link, config.port, config.baud)) {
  bus_.Subscribe<pose_t>("POSE", [this](const pose_t& m) { OnPose(m); });
  bus_.Subscribe<attitude_setpoint_t>("ATTITUDE_SETPOINT",
                                      [this](const attitude_setpoint_t& m) { OnSetpoint(m); });
  bus_.Subscribe<flight_state_t>("FLIGHT_STATE", [this](const flight_state_t& m) {
    const bool takes_off = m.state == flight_state_t::TAKEOFF;
    bridge_.OnFlightState(
        takes_off || m.state == flight_state_t::IDLE || m.state == flight_state_t::READY,
        takes_off || m.state == flight_state_t::CHASE || m.state == flight_state_t::SEARCH);
  });
  bus_.Subscribe<command_t>("COMMAND", [this](const command_t& m) { OnCommand(m); });
}

void FcuNode::OnPose(const pose_t& message) { bridge_.OnPose(FromMessage(message), bus_.Now()); }

void FcuNode::OnSetpoint(const attitude_setpoint_t& message) {
  bridge_.OnSetpoint(FromMessage(message), message.utime, bus_.Now());
}

/// Mission answers; where it or control hangs the motors are cut all the same. It is sent for a
/// while: obeyed twice it does no harm, and whoever has just begun knows the autopilot soon.
void FcuNode::OnCommand(const command_t& message) {
  const double age = bus::Seconds(bus_.Now(), message.utime);
  if (message.kind == command_t::KILL && bus::IsForced(message) &&
      std::abs(age) <= world::kMostAge.command)
    bridge_.Kill();
}

/// The tick's own time may lag behind; what happens here is measured on the bus's clock.
void FcuNode::Tick(int64_t /*utime*/) {
  now_ = bus_.Now();
  if (!first_tick_) first_tick_ = now_;
  TakeIn(now_);
  bridge_.Tick(now_);
  SendOut();
  Notice();
}

void FcuNode::TakeIn(int64_t now) {
  for (const Arrival& a : transport_->Take())
    bridge_.Receive(now - a.age, now, a.bytes.data(), a.bytes.size(), transport_->whole(), a.peer);
  for (const ImuSample& sample : bridge_.TakeImu()) {
    imu_t m{};
    m.utime = sample.utime;
    bus::Set(m.accel, sample.accel);
    bus::Set(m.gyro, sample.gyro);
    bus_.Publish("IMU", m);
  }
}

void FcuNode::SendOut() {
  for (const auto& bytes : bridge_.TakeOutgoing()) transport_->Send(bytes, bridge_.peer());
}

void FcuNode::Notice() {
  using State = Handshake::State;
  const State state = bridge_.handshake().state();
  if (state == noticed_) return;
  noticed_ = state;
  if (state == State::kRefused || state == State::kFailsafe || state == State::kPilot ||
      state == State::kLanding)
    bus_.ReportError(Handshake::Name(state) + ": " + bridge_.handshake().reason());
}

std::string FcuNode::Silence() const {
  const std::string where = transport_->Name();
  if (const auto& stranger = bridge_.autopilot().stranger(); !stranger.empty())
    return where + ": " + stranger + "; this bridge speaks to PX4 only";
  const auto& counters = bridge_.reader().counters();
  if (counters.late > 0 && counters.frames == 0)
    return where + ": the clock of its signatures lags; it is told ours";
  if (counters.refused > 0 && counters.frames == 0)
    return where + ": frames come, but none is signed with our key";
  if (counters.frames > 0) return where + ": frames come, but no heartbeat of the PX4 asked for";
  return fmt::format("no autopilot heard on {}; check {}", where,
                     config_.link == "udp" ? "that PX4 sends there (MAVLink instance, firewall)"
                                           : "the wiring, the baud and PX4's MAV_n_CONFIG");
}

bus::NodeReport FcuNode::Report() const {
  using Level = bus::NodeReport::State;
  using State = Handshake::State;
  if (const std::string problem = transport_->Problem(); !problem.empty())
    return {Level::kFailed, problem};
  if (!bridge_.heard()) {
    const double waited = first_tick_ ? bus::Seconds(now_, *first_tick_) : 0.0;
    const bool patient = !bridge_.autopilot().known() && waited < config_.autopilot_silence;
    return {patient ? Level::kStarting : Level::kFailed, Silence() + "; " + bridge_.Words()};
  }
  const State state = bridge_.handshake().state();
  const Autopilot& autopilot = bridge_.autopilot();
  const std::string lacking = bridge_.rates().missing();
  const bool worse = state == State::kRefused || state == State::kFailsafe || !lacking.empty() ||
                     !bridge_.disagreement().empty();
  const std::string unsent =
      transport_->dropped() == 0 ? "" : fmt::format("; {} frames not sent", transport_->dropped());
  return {worse ? Level::kDegraded : Level::kOk,
          bridge_.Words() + unsent + (lacking.empty() ? "" : "; slow: " + lacking),
          fmt::format("{} {} {}", Handshake::Name(state), autopilot.armed(),
                      autopilot.on_ground(now_))};
}

}  // namespace chase::fcu
