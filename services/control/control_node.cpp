#include "services/control/control_node.h"

#include <fmt/format.h>

#include "chase/attitude_setpoint_t.hpp"
#include "common/bus/convert.h"

namespace chase::control {

namespace {

Plan FromMessage(const plan_t& m, int64_t origin) {
  Plan plan;
  plan.position = bus::FromMessage(m.position, origin);
  plan.yaw = Eigen::Map<const Eigen::VectorXd>(m.yaw.data(), m.n_yaw);
  return plan;
}

Estimate FromMessage(const pose_t& m) {
  return {bus::ToVector(m.pos), bus::ToVector(m.vel), bus::ToQuaternion(m.orientation)};
}

Health HealthOf(const pose_t& m) {
  if (m.health == pose_t::HEALTH_OK || m.health == pose_t::HEALTH_DEGRADED) return Health::kUsable;
  return m.health == pose_t::HEALTH_STARTING ? Health::kStarting : Health::kLost;
}

}  // namespace

ControlNode::ControlNode(bus::Bus& bus, const ControlConfig& config)
    : bus_(bus), controller_(config) {
  bus_.Subscribe<plan_t>("PLAN", [this](const plan_t& m) { OnPlan(m); });
  bus_.Subscribe<pose_t>("POSE", [this](const pose_t& m) { OnPose(m); });
}

void ControlNode::OnPlan(const plan_t& message) {
  if (!controller_.AddPlan(FromMessage(message, Origin(message.utime))))
    bus_.ReportError("PLAN left out: it starts before the one being flown, or is empty");
}

void ControlNode::OnPose(const pose_t& message) {
  const double t = bus::Seconds(message.utime, Origin(message.utime));
  std::optional<Setpoint> setpoint;
  {
    auto timer = bus_.Time("control");
    setpoint = controller_.Update(t, FromMessage(message), HealthOf(message));
  }
  if (setpoint) Send(message.utime, *setpoint);
}

void ControlNode::Send(int64_t utime, const Setpoint& setpoint) {
  attitude_setpoint_t m{};
  m.utime = utime;
  bus::Set(m.orientation, setpoint.R_WB);
  bus::Set(m.body_rate, setpoint.w_WB_B);
  m.thrust = setpoint.thrust;
  m.motors = attitude_setpoint_t::MOTORS_ON;
  bus_.Publish("ATTITUDE_SETPOINT", m);
}

int64_t ControlNode::Origin(int64_t utime) {
  if (!origin_) origin_ = utime;
  return *origin_;
}

bus::NodeReport ControlNode::Report() const {
  using State = bus::NodeReport::State;
  switch (controller_.mode()) {
    case Mode::kIdle:
      return {State::kStarting, "waiting for a plan and a pose"};
    case Mode::kTracking:
      return {State::kOk, fmt::format("tracking, {:.2f} m off", controller_.position_error())};
    case Mode::kHolding:
      return {State::kDegraded,
              fmt::format("no new plan since {:.1f} s: holding the last one's end",
                          controller_.overdue())};
    case Mode::kLevel:
      return {State::kFailed, "pose lost: level, sinking slowly"};
  }
  return {};
}

}  // namespace chase::control
