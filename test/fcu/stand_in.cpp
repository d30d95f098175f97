#include "stand_in.h"

#include <algorithm>

namespace chase::fcu::testing {
namespace {

constexpr double kGravity = 9.81;
constexpr double kAttitudeLag = 0.15;  // s
constexpr double kDrag = 0.3;          // 1/s
constexpr double kTouches = 0.01;      // m

}  // namespace

void StandIn::Receive(int64_t utime, const Bytes& bytes) {
  now_ = std::max(now_, utime);
  px4_.Receive(utime, now_, bytes);
}

void StandIn::Reboot(int64_t utime) {
  px4_.Reboot(utime);
  body_.p_WB.z() = 0.0;
  body_.v_WB.setZero();
}

void StandIn::PilotLifts(double height) {
  body_.p_WB.z() = height;
  body_.v_WB.setZero();
  body_.touches = false;
  px4_.Tick(now_, now_, body_);
  px4_.PilotMode(mavlink::kPositionMode);
  px4_.PilotArms(true);
}

void StandIn::Turn(const Eigen::Quaterniond& wanted, double dt) {
  const Eigen::Quaterniond before = body_.R_WB;
  body_.R_WB = before.slerp(std::min(1.0, dt / kAttitudeLag), wanted);
  const Eigen::Quaterniond step = before.conjugate() * body_.R_WB;
  body_.gyro = 2.0 / dt * (step.w() < 0.0 ? -1.0 : 1.0) * step.vec();
}

/// A point that is pushed along its own z axis.
void StandIn::Move(double dt) {
  const simulator::AttitudeSetpoint demand = px4_.Demand(body_);
  Turn(demand.motors ? demand.orientation : body_.R_WB, dt);
  body_.thrust = demand.motors ? demand.thrust : 0.0;
  const Eigen::Vector3d force =
      body_.R_WB * Eigen::Vector3d(0, 0, body_.thrust) - kDrag * body_.v_WB;
  Eigen::Vector3d& p = body_.p_WB;
  Eigen::Vector3d& v = body_.v_WB;
  v += dt * (force - Eigen::Vector3d(0, 0, kGravity));
  p += dt * v;
  const bool held = p.z() < 0.0 || (p.z() == 0.0 && v.z() < 0.0);
  if (held) p.z() = 0.0, v.setZero();
  body_.touches = p.z() <= kTouches;
  body_.accel =
      body_.R_WB.conjugate() * (held ? Eigen::Vector3d(0, 0, kGravity) : Eigen::Vector3d(force));
}

void StandIn::Tick(int64_t utime) {
  const double dt = 1e-6 * static_cast<double>(std::max(now_, utime) - last_tick_);
  now_ = last_tick_ = std::max(now_, utime);
  if (dt > 0.0) Move(std::min(dt, 0.02));
  px4_.Tick(now_, now_, body_);
}

}  // namespace chase::fcu::testing
