#include "services/simulator/own_mode.h"

#include <algorithm>

#include "common/math/rotation.h"

namespace chase::simulator {
namespace {

using Eigen::Vector3d;

// MPC_XY_P, MPC_XY_VEL_P_ACC, MPC_Z_P, MPC_Z_VEL_P_ACC, MPC_LAND_SPEED as DEPLOYMENT.md sets it,
// and bounds.
constexpr double kPositionGain = 0.95, kVelocityGain = 1.8, kHeightGain = 1.0, kClimbGain = 4.0;
constexpr double kLandSpeed = 0.5, kMostSpeed = 2.0, kMostPush = 3.0;

/// No longer than `limit`.
Vector3d Shortened(const Vector3d& v, double limit) {
  return v.norm() > limit ? Vector3d(v * (limit / v.norm())) : v;
}

Vector3d Level(const Vector3d& v) { return {v.x(), v.y(), 0.0}; }

}  // namespace

OwnMode::OwnMode(const Px4Body& body)
    : p_(body.p_WB), yaw_(math::Yaw(body.R_WB)), resets_(body.resets) {}

/// Level, back to its place.
Vector3d OwnMode::Push(const Px4Body& body) const {
  if (!body.knows_velocity) return Vector3d::Zero();
  const Vector3d wanted = Shortened(kPositionGain * Level(p_ - body.p_WB), kMostSpeed);
  return Shortened(kVelocityGain * (wanted - Level(body.v_WB)), kMostPush);
}

AttitudeSetpoint OwnMode::Demand(const Px4Body& body, bool lands) const {
  AttitudeSetpoint demand;
  demand.orientation = math::FromYaw(yaw_);
  if (body.touches) return demand;
  const double climb =
      lands || !body.knows_velocity
          ? -kLandSpeed
          : std::clamp(kHeightGain * (p_ - body.p_WB).z(), -kLandSpeed, kLandSpeed);
  Vector3d push = Push(body);
  push.z() = std::max(body.hover_thrust + kClimbGain * (climb - body.v_WB.z()), 0.3 * kGravity);
  demand.orientation = math::FromZAxisAndYaw(push, yaw_);
  demand.thrust = push.norm();
  return demand;
}

}  // namespace chase::simulator
