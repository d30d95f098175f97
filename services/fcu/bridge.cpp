#include "services/fcu/bridge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/math/rotation.h"
#include "common/world/ages.h"

namespace chase::fcu {
namespace {

constexpr int64_t kHeartbeatPeriod = 1'000'000;  // us
constexpr int64_t kTimesyncPeriod = 100'000;     // us: PX4's own rate
constexpr int64_t kSoonTimesync = 20'000;        // us, while the clock is not known or has jumped
// us between requests for a heartbeat: PX4 sends it once a second and refuses another interval for
// it (MavlinkReceiver::set_message_interval), but not a request.
constexpr int64_t kWordPeriod = 100'000;
// PX4, Timesync.hpp, CONVERGENCE_WINDOW: until then it takes a pose's arrival for its time.
constexpr int kTimeAnswers = 500;
constexpr double kLongestTrip = 0.010;  // s, MAX_RTT_SAMPLE: answers that took longer do not count
constexpr std::size_t kTimeRequests = 20;  // on their way: 2 s
constexpr double kWarningAge = 10.0;       // s in which a text explains a refusal
// s: of a pose that an attitude loop is closed on. At max_rate (3.8 rad/s) it is 11 degrees old.
constexpr double kLoopAge = 0.05;

int64_t Period(double rate) { return static_cast<int64_t>(std::llround(1e6 / rate)); }

double Seconds(int64_t from, int64_t to) { return 1e-6 * static_cast<double>(to - from); }

/// Is something due that comes each `period`? Late calls lose time, never catch up.
bool Due(int64_t now, int64_t period, int64_t* next) {
  if (now < *next) return false;
  *next = std::max(*next + period, now - period + 1);
  return true;
}

}  // namespace

Bridge::Bridge(const FcuConfig& config, const std::optional<Key>& key)
    : config_(config),
      signing_(key ? std::make_unique<Signing>(*key, static_cast<uint8_t>(config.signing_link))
                   : nullptr),
      reader_(signing_.get()),
      writer_(static_cast<uint8_t>(config.system), static_cast<uint8_t>(config.component),
              signing_.get()),
      autopilot_(config.autopilot_system),
      rates_(config.imu_rate),
      handshake_(config.engages(), config.give_up_after) {
  if (config.system == 0) writer_.SetSystem(1);  // until the autopilot's is known
}

bool Bridge::Hears(int64_t now) const {
  return autopilot_.known() && autopilot_.silence(now) <= config_.autopilot_silence;
}

void Bridge::Receive(int64_t arrival, int64_t now, const uint8_t* data, std::size_t size,
                     bool whole, uint64_t from) {
  if (from != peer_ && Hears(now)) return;
  const int64_t late = reader_.counters().late;
  reader_.Add(now, data, size, [&](const Frame& frame) { OnFrame(frame, {arrival, now, from}); });
  // A PX4 without a clock begins at the time that it stored, and takes ours from our heartbeat.
  if (reader_.counters().late > late && !Hears(now)) peer_ = from;
  if (whole) reader_.Reset();
}

void Bridge::OnFrame(const Frame& frame, const Heard& when) {
  const bool beats = frame.id == mav::Heartbeat::kId;
  if (!autopilot_.known() && !beats) return AskWho(frame, when);
  if ((when.from != peer_ && !beats) || !autopilot_.Take(frame, when.arrival)) return;
  if (beats) peer_ = when.from;
  if (config_.system == 0) writer_.SetSystem(autopilot_.system());
  rates_.OnMessage(frame.id);
  if (const auto m = As<mav::Timesync>(frame)) OnTimesync(*m, when);
  if (const auto m = As<mav::CommandAck>(frame)) {
    const bool to_others = (m->target_system != 0 && m->target_system != writer_.system()) ||
                           (m->target_component != 0 && m->target_component != writer_.component());
    if (to_others) return;
    if (m->command == static_cast<uint16_t>(mav::MavCmd::SET_MESSAGE_INTERVAL))
      rates_.OnAnswer(m->result);
    else
      handshake_.OnAck(m->command, m->result, when.now);
    if (m->command == static_cast<uint16_t>(mav::MavCmd::COMPONENT_ARM_DISARM) &&
        m->result != static_cast<uint8_t>(mav::MavResult::ACCEPTED))
      AskForChecks(when.now);
  }
  if (const auto sample = imu_.Take(frame, clock_, when.now)) {
    touchdown_.Feel(*sample);
    samples_.push_back(*sample);
  }
}

/// Its next heartbeat is up to a second away, in which a flight without setpoints ends.
void Bridge::AskWho(const Frame& frame, const Heard& when) {
  if (!autopilot_.MayBe(frame)) return;
  peer_ = when.from;
  AskWord(when.now, frame.system);
}

void Bridge::AskWord(int64_t now, uint8_t system) {
  if (!Due(now, kWordPeriod, &next_word_)) return;
  mav::CommandLong request;
  request.command = static_cast<uint16_t>(mav::MavCmd::REQUEST_MESSAGE);
  request.param1 = static_cast<float>(mav::Heartbeat::kId);
  Send(now, request, system);
}

/// A request is answered with the middle of its stay here, so that the asker's halved round trip
/// meets the time that we say. Which answers it has taken it does not tell: of those that are quick
/// enough, the ones around a request of ours count where that one went there and back.
void Bridge::OnTimesync(const mav::Timesync& m, const Heard& when) {
  if (m.tc1 == 0) {
    mav::Timesync answer;
    answer.tc1 = 1000 * (when.arrival + (when.now - when.arrival) / 2);
    answer.ts1 = m.ts1;
    const auto asked = clock_.HostTime(m.ts1 / 1000);
    if (asked && Seconds(*asked, when.now) + 0.5 * clock_.round_trip() < kLongestTrip) ++answered_;
    return Send(when.now, answer);
  }
  const auto request = std::find(time_requests_.begin(), time_requests_.end(), m.ts1);
  if (request == time_requests_.end()) return;  // another's
  if (m.ts1 == time_requests_.back()) time_answers_ += std::exchange(answered_before_, 0);
  time_requests_.erase(request);
  clock_.Add(m.ts1 / 1000, m.tc1 / 1000, when.arrival);
}

/// It says again which of them fail: an arming was refused.
void Bridge::AskForChecks(int64_t now) {
  mav::CommandLong request;
  request.command = static_cast<uint16_t>(mav::MavCmd::RUN_PREARM_CHECKS);
  Send(now, request, autopilot_.system());
}

void Bridge::AskTime(int64_t now) {
  mav::Timesync request;
  request.ts1 = 1000 * now;
  answered_before_ = std::exchange(answered_, 0);
  time_requests_.push_back(request.ts1);
  if (time_requests_.size() > kTimeRequests) time_requests_.pop_front();
  Send(now, request);
}

void Bridge::OnPose(const Pose& pose, int64_t now) {
  if (pose_ && pose.epoch != pose_->epoch) {
    ++resets_;
  } else if (pose_ && pose.utime <= pose_->utime) {
    return;  // a repetition
  }
  pose_ = pose;
  pose_arrival_ = now;
  if (!pose.starting && frame_ != pose.epoch) TakeFrame(now);
  const bool in_frame = frame_ == pose.epoch;
  if (!pose.starting) framed_ = in_frame;
  if (in_frame) pose_ = Turned(pose, turn_);
  if (!pose.usable || !heard_ || !in_frame || PoseAge(now) > world::kMostAge.pose) return;
  if (!Due(pose.utime, Period(config_.odometry_rate), &next_odometry_)) return;
  Send(now, ExternalVision(*pose_, resets_));
  ++odometry_sent_;
}

/// On the ground the autopilot takes its heading from POSE. In the air the heading that it flies by
/// must not turn under the setpoints: it is told a W turned to where its own attitude has it, by
/// the same yaw as long as that W lasts; without its attitude, nothing of that W.
void Bridge::TakeFrame(int64_t now) {
  if (!heard_) return;
  double turn = 0.0;
  if (autopilot_.armed() && !autopilot_.on_ground(now)) {
    const auto& attitude = autopilot_.attitude();
    if (!attitude || Seconds(attitude->utime, now) > world::kMostAge.attitude) return;
    turn = math::Yaw(attitude->R_WB * pose_->R_WB.conjugate());
    // Whoever begins anew in flight cannot tell a turn from what the autopilot is off.
    if (!frame_ && std::abs(turn) <= config_.attitude_gate_deg * M_PI / 180.0) turn = 0.0;
  }
  turn_ = turn;
  frame_ = pose_->epoch;
  frame_since_ = pose_->utime;
  setpoint_.reset();
}

void Bridge::OnSetpoint(const Setpoint& setpoint, int64_t utime, int64_t now) {
  // A publisher that begins anew may have an older clock.
  const bool repeated = utime == setpoint_utime_ ||
                        (utime < setpoint_utime_ && Seconds(setpoint_arrival_, now) < 1.0);
  if ((setpoint_ && repeated) || utime < frame_since_) return;
  frame_since_ = 0;
  setpoint_ = setpoint;
  setpoint_utime_ = utime;
  setpoint_arrival_ = now;
}

bool Bridge::IsFresh(int64_t now) const {
  // Stamped with the pose that it answers; in a queue it ages on, and poses that always come later
  // than that are none to fly by.
  return setpoint_ && framed_ && Seconds(setpoint_arrival_, now) <= config_.setpoint_age &&
         world::IsFresh(Seconds(setpoint_utime_, now), config_.setpoint_age + world::kMostAge.pose);
}

double Bridge::PoseAge(int64_t now) const {
  return Seconds(std::min(pose_arrival_, pose_->utime), now);
}

std::string Bridge::PoseProblem(int64_t now) const {
  if (!pose_) return "no POSE yet";
  if (!pose_->usable) return "POSE is not usable";
  const double age = PoseAge(now);
  return age > world::kMostAge.pose ? fmt::format("POSE is {:.2f} s old", age) : "";
}

std::string Bridge::AttitudeProblem(int64_t now) const {
  const auto& attitude = autopilot_.attitude();
  if (!attitude || Seconds(attitude->utime, now) > world::kMostAge.attitude)
    return "the autopilot does not tell its attitude";
  const double degrees = attitude->R_WB.angularDistance(pose_->R_WB) * 180.0 / M_PI;
  if (degrees <= config_.attitude_gate_deg) return "";
  return fmt::format(
      "the autopilot's attitude is {:.0f} degrees off POSE: EKF2_EV_CTRL has to "
      "take the yaw",
      degrees);
}

std::string Bridge::Missing(int64_t now) const {
  if (std::string unfit = autopilot_.Unfit(); !unfit.empty()) return unfit;
  if (!clock_.synced()) return "the autopilot's clock is not known yet";
  // In flight its estimate of our clock is as old as the flight, whoever flew it until now.
  const bool in_flight = autopilot_.armed() && !autopilot_.on_ground(now);
  if (time_answers_ < kTimeAnswers && !in_flight)
    return fmt::format("the autopilot learns our clock: {} of {} answers within {:.0f} ms",
                       time_answers_, kTimeAnswers, 1e3 * kLongestTrip);
  if (std::string problem = PoseProblem(now); !problem.empty()) return problem;
  return AttitudeProblem(now);
}

Facts Bridge::Gather(int64_t now) const {
  Facts f;
  f.utime = now;
  f.heard = heard_;
  f.told = autopilot_.heartbeat_utime();
  f.gap = Seconds(std::min(autopilot_.frame_utime(), flown_by_.value_or(now)), now);
  f.armed = autopilot_.armed();
  f.failsafe = autopilot_.failsafe();
  f.terminated = autopilot_.terminated();
  f.mode = autopilot_.mode();
  f.on_ground = autopilot_.on_ground(now);
  f.wish = IsFresh(now) && setpoint_->motors;
  f.motors_off = IsFresh(now) && !setpoint_->motors;
  f.borne = touchdown_.IsBorne(now);
  f.blind = !pose_ || PoseAge(now) > world::kMostAge.velocity;
  f.missing = missing_;
  f.asked = !led_ || (anew_ && wanted_);
  f.said = autopilot_.Warning(now, kWarningAge);
  return f;
}

void Bridge::Tick(int64_t now) {
  ticked_ = now;
  const bool was_heard = heard_;
  heard_ = Hears(now);
  if ((heard_ && !was_heard) || clock_.restarts() != restarts_) rates_.Restart();
  if (clock_.restarts() != restarts_) time_answers_ = answered_before_ = answered_ = 0;
  restarts_ = clock_.restarts();
  missing_ = heard_ ? Missing(now) : "no PX4 is heard";
  const bool touched_down = handshake_.state() == Handshake::State::kTouchdown;
  handshake_.Update(Gather(now));
  if (touched_down && handshake_.state() == Handshake::State::kLanding) Catch(now);
  const bool touches_down = handshake_.state() == Handshake::State::kTouchdown;
  const bool flies = touches_down || handshake_.state() == Handshake::State::kFlying;
  disagreement_ = flies && pose_ && frame_ == pose_->epoch ? AttitudeProblem(now) : "";
  if (!flies) flown_by_.reset();
  if (handshake_.ended()) anew_ = false;
  if (Due(now, kHeartbeatPeriod, &next_heartbeat_)) SendHeartbeat(now);
  if (!autopilot_.known()) return;
  if (Due(now, clock_.settled() ? kTimesyncPeriod : kSoonTimesync, &next_timesync_)) AskTime(now);
  if (handshake_.streams() && IsFresh(now) && (setpoint_->motors || touches_down) &&
      Due(now, Period(config_.setpoint_rate), &next_setpoint_))
    SendSetpoint(now);
  SendCommands(now);
}

void Bridge::SendHeartbeat(int64_t now) {
  mav::Heartbeat m;
  m.type = static_cast<uint8_t>(mav::MavType::ONBOARD_CONTROLLER);
  m.autopilot = static_cast<uint8_t>(mav::MavAutopilot::INVALID);
  m.system_status = static_cast<uint8_t>(mav::MavState::ACTIVE);
  m.mavlink_version = 3;
  Send(now, m);
}

/// It was not the ground: it hovers until the autopilot has it, by an attitude, as nobody closes
/// the loop on rates meanwhile.
void Bridge::Catch(int64_t now) {
  if (!touchdown_.Falls(now) || !setpoint_) return;
  touchdown_.Flies(config_.hover_thrust, now);
  SendSetpoint(now, false);
}

void Bridge::SendSetpoint(int64_t now, bool by_rates) {
  const bool known = by_rates && pose_->usable && PoseAge(now) <= kLoopAge;
  mav::SetAttitudeTarget m = AttitudeTarget(
      Turned(*setpoint_, turn_), known ? std::optional(pose_->R_WB) : std::nullopt, config_);
  if (setpoint_->motors)
    touchdown_.Flies(m.thrust, now);
  else
    m.thrust = static_cast<float>(touchdown_.Lower(config_.hover_thrust, now));
  m.time_boot_ms = static_cast<uint32_t>(now / 1000);
  m.target_system = autopilot_.system();
  m.target_component = static_cast<uint8_t>(mav::MavComponent::AUTOPILOT1);
  Send(now, m);
  ++setpoints_sent_;
  if (flown_by_) longest_setpoint_gap_ = std::max(longest_setpoint_gap_, Seconds(*flown_by_, now));
  flown_by_ = now;
}

void Bridge::SendCommands(int64_t now) {
  if (const auto command = handshake_.NextCommand(now)) Send(now, *command, autopilot_.system());
  if (!heard_) return;
  if (handshake_.needs_word()) AskWord(now, autopilot_.system());
  if (const auto request = rates_.Tick(now)) Send(now, *request, autopilot_.system());
}

void Bridge::Send(int64_t now, mav::CommandLong command, uint8_t system) {
  command.target_system = system;
  command.target_component = static_cast<uint8_t>(mav::MavComponent::AUTOPILOT1);
  outgoing_.push_back(writer_.Write(now, command));
}

std::vector<Bridge::Bytes> Bridge::TakeOutgoing() { return std::exchange(outgoing_, {}); }

std::vector<ImuSample> Bridge::TakeImu() { return std::exchange(samples_, {}); }

std::string Bridge::Words() const {
  std::string words =
      fmt::format("{}: {}", Handshake::Name(handshake_.state()), handshake_.reason());
  if (!heard_) return words;
  if (handshake_.state() == Handshake::State::kStandby)
    words += missing_.empty() ? "; waits for setpoints" : "; waits: " + missing_;
  if (!disagreement_.empty()) words += "; " + disagreement_;
  words += "; " + autopilot_.Words(ticked_);
  words += fmt::format("; clock +-{:.2f} ms, round trip {:.1f} ms", 1e3 * clock_.jitter(),
                       1e3 * clock_.round_trip());
  words += fmt::format("; {} {:.0f} Hz", imu_.source(), rates_.imu_rate());
  words += fmt::format(
      "; {} setpoints sent, in flight at most {:.0f} ms apart; {} odometry sent, {} frames lost",
      setpoints_sent_, 1e3 * longest_setpoint_gap_, odometry_sent_, reader_.counters().lost);
  if (autopilot_.position() && pose_)
    words += fmt::format("; its position is {:.2f} m off POSE",
                         (*autopilot_.position() - pose_->p_WB).norm());
  return words;
}

}  // namespace chase::fcu
