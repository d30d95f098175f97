#include "services/control/control_node.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/tracking_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/plan_message.h"
#include "common/math/gaussian.h"
#include "common/math/rotation.h"
#include "common/world/ages.h"

namespace chase::control {

namespace {

constexpr auto kMostLate = static_cast<int64_t>(1e6 * world::kMostAge.pose);  // us
constexpr size_t kLists = 8;                                                  // 0.8 s at 10 Hz
// s from the list to the start of a plan made for it, which is a little ahead of when it is made.
constexpr double kOldestList = world::kMostAge.obstacles + world::kMostAge.pose;

Estimate FromMessage(const pose_t& m) {
  const Eigen::Map<const Eigen::Matrix<double, 9, 9, Eigen::RowMajor>> P(m.local_covariance);
  return {bus::ToVector(m.pos), bus::ToVector(m.vel), bus::ToQuaternion(m.orientation),
          bus::ToVector(m.accel), math::LargestSigma(P.block<3, 3>(3, 3))};
}

// A pose that odometry stands for is good for plans while its velocity is: planning allows for a
// frame that drifts.
Health HealthOf(const pose_t& m, double velocity_sigma, const ControlConfig& config) {
  if (m.health == pose_t::HEALTH_STARTING) return Health::kStarting;
  const bool lost = m.health == pose_t::HEALTH_LOST || velocity_sigma > config.land_speed;
  return lost ? Health::kLost : Health::kUsable;
}

// In any other state nothing is to leave the ground.
bool AsksToFly(int8_t state) {
  return state != flight_state_t::IDLE && state != flight_state_t::READY &&
         state != flight_state_t::HOLD && state != flight_state_t::DONE;
}

}  // namespace

ControlNode::ControlNode(bus::Bus& bus, const ControlConfig& config)
    : bus_(bus), config_(config), controller_(config), fence_(config.geofence) {
  bus_.Subscribe<plan_t>("PLAN", [this](const plan_t& m) { OnPlan(m); });
  bus_.Subscribe<obstacles_t>("OBSTACLES", [this](const obstacles_t& m) { OnObstacles(m); });
  bus_.Subscribe<flight_state_t>("FLIGHT_STATE", [this](const flight_state_t& m) { OnState(m); });
  bus_.Subscribe<geofence_t>("GEOFENCE", [this](const geofence_t& m) { OnGeofence(m); });
  bus_.Subscribe<status_t>("FCU_STATUS", [this](const status_t& m) { autopilot_.Hear(m); });
  bus_.Subscribe<pose_t>("POSE", [this](const pose_t& m) { OnPose(m); });
}

// Another mission process counts its messages anew. What is too old is not of this flight.
void ControlNode::OnState(const flight_state_t& message) {
  if (state_order_.IsOvertaken(message.utime)) return;
  if (!world::IsFresh(bus::Seconds(bus_.Now(), message.utime), world::kMostAge.flight_state))
    return;
  hears_mission_ = true;
  // One that began anew in flight knows none; the place has not moved. Until it has heard HOME,
  // what was led before holds, for 2 s; DONE is obeyed at once.
  if (message.has_home != 0) {
    led_ = message;
  } else if (led_) {
    TellHome();
    const double ago = bus::Seconds(message.utime, led_->utime);
    if (world::IsFresh(ago, world::kMostAge.flight_state) && message.state != flight_state_t::DONE)
      return;
  }
  asked_to_fly_ = AsksToFly(message.state) ? message.utime : 0;
  const bool lands = message.state == flight_state_t::LAND;
  if (!lands)
    landing_.reset();
  else if (!landing_ || landing_->first != message.sender_start)
    landing_ = {message.sender_start, message.seq};
  controller_.SetLanding(lands);
  if (message.state == flight_state_t::DONE) controller_.Cut();
}

Eigen::Vector3d ControlNode::Home() const { return bus::ToVector(led_->home); }

// What mission said before it began anew.
void ControlNode::TellHome() {
  flight_state_t message = *led_;
  message.utime = bus_.Now();
  bus_.Publish("HOME", message);
}

void ControlNode::OnGeofence(const geofence_t& message) {
  if (config_.geofence.Exists() || !led_ || led_->epoch != message.epoch) return;
  fence_ = bus::FromMessage(message, Home());
}

// No plan stands on a list that leaves some out.
void ControlNode::OnObstacles(const obstacles_t& message) {
  if (!epoch_.Is(message.epoch) || message.n_cut > 0) return;
  const int64_t origin = Origin(message.utime);
  std::vector<world::Obstacle> list;
  for (const obstacle_t& o : message.obstacles) list.push_back(bus::FromMessage(o, origin));
  if (lists_.size() == kLists) lists_.pop_front();
  lists_.push_back({message.seq, message.utime, std::move(list)});
}

// The list that the plan was made for; null where it was never heard.
const ControlNode::List* ControlNode::ListOf(const plan_t& message) const {
  const int32_t seq = bus::InputOf(message, "OBSTACLES");
  for (auto list = lists_.rbegin(); list != lists_.rend(); ++list)
    if (list->seq == seq) return &*list;
  return nullptr;
}

// Whoever plans or leads the flight may err: what leaves the fence, or comes nearer to it than the
// body keeps to its plan, is not flown, and the plan before comes to rest inside. A last resort and
// a way out of an obstacle's reach are flown, since what else there is touches or stops later; so
// is what leads a body that is outside nearer to the fence, and to the ground where the take-off
// place is not known.
std::string ControlNode::Breach(const world::Claim& claim, bool to_land) const {
  if (!fence_.Exists() || claim.starts_inside) return "";  // a last resort may start inside
  if (!led_ || !epoch_.Is(led_->epoch))
    return to_land ? "" : "the take-off place is not known, nor the geofence";
  std::vector<Eigen::Vector3d> places = world::PlacesOn(claim.position, claim.stop);
  for (Eigen::Vector3d& p : places) p -= Home();
  return fence_.Refusal(p_WB_ - Home(), places, config_.tracking_tube);
}

std::string ControlNode::Refusal(const plan_t& message) {
  const world::Claim claim = bus::ClaimOf(message, Origin(message.utime));
  const List* list = ListOf(message);
  if (claim.certified && !list) return "the obstacles that it was made for were not heard";
  if (claim.certified && !world::IsFresh(bus::Seconds(message.utime, list->utime), kOldestList))
    return "the obstacles that it was made for are of another time";
  const auto timer = bus_.Time("check");
  static const std::vector<world::Obstacle> none;
  std::string bad =
      world::Refute(claim, {config_.hard_radius(), config_.sigmas}, list ? list->obstacles : none);
  Plan plan;
  plan.to_land = landing_ && bus::InputOf(message, "FLIGHT_STATE") >= landing_->second;
  if (bad.empty()) bad = Breach(claim, plan.to_land);
  if (!bad.empty()) return bad;
  plan.position = claim.position;
  plan.yaw = Eigen::Map<const Eigen::VectorXd>(message.yaw.data(), message.n_yaw);
  plan.stop = claim.stop;
  if (claim.certified) plan.tube = claim.hard_radius - config_.drone_radius;
  plan.seq = message.seq;
  return controller_.AddPlan(plan);
}

void ControlNode::OnPlan(const plan_t& message) {
  if (!epoch_.Is(message.epoch)) return;
  ++n_plans_;
  const std::string bad = Refusal(message);
  if (bad.empty()) return;
  ++n_refused_;
  bus_.ReportError(fmt::format("PLAN {} left out: {}", message.seq, bad));
}

// For 2 s late poses only correct dead reckoning: with these gains the loop is unstable at 0.3 s of
// delay, and an acceleration that old is not that of the thrust asked for last. Then they are flown
// by, for want of better. Judged by the bus's clock, because a queue shows in no
// stamp: a replay sees the times at which the recorder heard them.
void ControlNode::OnPose(const pose_t& message) {
  if (pose_age_.IsLate(message.utime, bus_.Now(), kMostLate)) {
    if (Silence() <= world::kMostAge.velocity) return UpdateLate(message);
    pose_age_.Reset();
  }
  pose_age_.Take(message.utime, bus_.Now());
  const double t = bus::Seconds(message.utime, Origin(message.utime));
  ticks_without_pose_ = 0;
  if (epoch_.Change(message.epoch)) {
    controller_.ForgetPlans();
    lists_.clear();
  }
  if (message.health != pose_t::HEALTH_STARTING && flown_.Change(message.epoch))
    controller_.TurnFrame(t, math::Yaw(bus::ToQuaternion(message.orientation)));
  const Estimate estimate = FromMessage(message);
  if (estimate.p_WB.allFinite()) p_WB_ = estimate.p_WB;
  const Health health = HealthOf(message, estimate.velocity_sigma, config_);
  pose_reason_ = health == Health::kUsable ? ""
                 : message.reason.empty()  ? "uncertain"
                                           : message.reason;
  const bool asked = bus::Seconds(message.utime, asked_to_fly_) <= world::kMostAge.flight_state;
  const bool obeys = autopilot_.Obeys(message.utime), on_ground = autopilot_.IsOnGround();
  const bool may_begin = asked || obeys || !on_ground || !hears_mission_;
  controller_.SetAutopilot(obeys, on_ground && asked, may_begin);
  std::optional<Setpoint> setpoint;
  {
    auto timer = bus_.Time("control");
    setpoint = controller_.Update(t, estimate, health);
  }
  if (setpoint) Send(message.utime, *setpoint);
  if (std::abs(message.utime - last_tracking_) >= kTick) SendTracking(message.utime);
}

void ControlNode::UpdateLate(const pose_t& message) {
  if (!flown_.Is(message.epoch)) return;
  const Estimate estimate = FromMessage(message);
  controller_.UpdateLate(bus::Seconds(message.utime, Origin(message.utime)), estimate,
                         HealthOf(message, estimate.velocity_sigma, config_));
}

// Without poses: by dead reckoning, until the autopilot's own limit on silence may act. Ticks are
// counted rather than stamps compared: whoever sets the clock does not make the pose old.
void ControlNode::Tick(int64_t utime) {
  const double silence = Silence();
  ++ticks_without_pose_;
  if (silence <= world::kMostAge.pose || silence > world::kMostAge.velocity) return;
  const std::optional<Setpoint> setpoint = controller_.Blind(silence);
  if (!setpoint) return;
  pose_reason_ = "no pose is heard";
  Send(bus_.Now(), *setpoint);  // a tick's own time may lag behind the last pose's
  SendTracking(utime);
}

void ControlNode::Send(int64_t utime, const Setpoint& setpoint) {
  attitude_setpoint_t m{};
  m.utime = utime;
  bus::Set(m.orientation, setpoint.R_WB);
  bus::Set(m.body_rate, setpoint.w_WB_B);
  m.thrust = setpoint.thrust;
  m.motors = setpoint.motors ? attitude_setpoint_t::MOTORS_ON : attitude_setpoint_t::MOTORS_OFF;
  bus_.Publish("ATTITUDE_SETPOINT", m);
}

void ControlNode::SendTracking(int64_t utime) {
  last_tracking_ = utime;
  tracking_t m{};
  m.utime = utime;
  m.epoch = epoch_.value();
  m.following = static_cast<int8_t>(controller_.following());
  m.plan_seq = controller_.plan_seq();
  bus::Set(m.error, controller_.error());
  m.bound = controller_.error_bound();
  m.reason = Reason();
  bus_.Publish("TRACKING", m);
}

std::string ControlNode::Reason() const {
  switch (controller_.following()) {
    case Following::kNone:
      return controller_.stands() ? "on the ground: waiting for the autopilot and a plan"
                                  : "waiting for a plan and a pose";
    case Following::kPlan:
      return "";
    case Following::kStop:
      return fmt::format("no new plan since {:.1f} s: on the last one's stop",
                         controller_.overdue());
    case Following::kBrake:
      if (!pose_reason_.empty()) return "pose lost, braking: " + pose_reason_;
      return controller_.brakes_to_land() ? "landing: braking first" : "no plan: braking";
    case Following::kLand:
      if (controller_.is_down()) return "landed: motors off";
      if (controller_.is_cut()) return "the flight is over: motors off";
      return pose_reason_.empty() ? "landing" : "pose lost, landing: " + pose_reason_;
  }
  return "";
}

int64_t ControlNode::Origin(int64_t utime) {
  if (!origin_) origin_ = utime;
  return *origin_;
}

bus::NodeReport ControlNode::Report() const {
  using State = bus::NodeReport::State;
  const std::string plans = fmt::format("; {} plans, {} refused", n_plans_, n_refused_);
  switch (controller_.following()) {
    case Following::kNone:
      return {State::kStarting, Reason() + plans};
    case Following::kPlan:
      return {State::kOk, fmt::format("tracking, {:.2f} m off, below {:.2f} m of late",
                                      controller_.error().norm(), controller_.error_bound()) +
                              plans};
    case Following::kStop:
      return {State::kDegraded, Reason() + plans};
    case Following::kBrake:
      if (!controller_.brakes_to_land()) return {State::kFailed, Reason() + plans};
      [[fallthrough]];
    case Following::kLand:
      return {pose_reason_.empty() ? State::kOk : State::kFailed, Reason() + plans};
  }
  return {};
}

}  // namespace chase::control
