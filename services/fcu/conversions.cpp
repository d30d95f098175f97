#include "services/fcu/conversions.h"

#include <algorithm>
#include <cmath>

#include "common/math/rotation.h"

namespace chase::fcu {
namespace {

constexpr double kGravity = 9.81;                // m/s^2, of the setpoint's "hover"
constexpr double kStandardGravity = 9.80665e-3;  // m/s^2 per mG, as MAVLink means it

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Mask = mav::AttitudeTargetTypemask;

uint8_t Bits(Mask a, Mask b) {
  return static_cast<uint8_t>(static_cast<uint32_t>(a) | static_cast<uint32_t>(b));
}

void Set(const Eigen::Quaterniond& q, std::array<float, 4>* out) {
  *out = {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()),
          static_cast<float>(q.z())};
}

/// Row by row from the diagonal on.
void SetUpperTriangle(const Matrix6d& m, std::array<float, 21>* out) {
  std::size_t n = 0;
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column) (*out)[n++] = static_cast<float>(m(row, column));
}

/// Of (position in NED, rotation error in NED).
Matrix6d PoseCovariance(const Matrix9d& P) {
  Matrix6d joint;
  joint << P.block<3, 3>(0, 0), P.block<3, 3>(0, 6), P.block<3, 3>(6, 0), P.block<3, 3>(6, 6);
  Matrix6d swap = Matrix6d::Zero();
  swap.block<3, 3>(0, 0) = WorldSwap();
  swap.block<3, 3>(3, 3) = WorldSwap();
  return swap * joint * swap.transpose();
}

/// Of the velocity in FRD. That the axes themselves are uncertain is left out: it is of second
/// order beside the velocity's own error. POSE has no covariance of the rates: zero, "not known".
Matrix6d VelocityCovariance(const Pose& pose) {
  const Eigen::Matrix3d to_body = BodySwap() * pose.R_WB.conjugate().toRotationMatrix();
  Matrix6d covariance = Matrix6d::Zero();
  covariance.block<3, 3>(0, 0) = to_body * pose.covariance.block<3, 3>(3, 3) * to_body.transpose();
  return covariance;
}

/// Angular velocity that turns R to R_desired: PX4's own law, 2 sgn(w) of the error's vector part.
Eigen::Vector3d RateTowards(const Eigen::Quaterniond& R, const Eigen::Quaterniond& R_desired,
                            const FcuConfig& config) {
  const Eigen::Quaterniond error = R.conjugate() * R_desired;
  const double sign = error.w() < 0.0 ? -2.0 : 2.0;
  return config.attitude_gain.cwiseProduct(sign * error.vec());
}

}  // namespace

Pose Turned(Pose pose, double yaw) {
  const Eigen::Quaterniond turn = math::FromYaw(yaw);
  pose.p_WB = turn * pose.p_WB;
  pose.v_WB = turn * pose.v_WB;
  pose.R_WB = turn * pose.R_WB;
  Matrix9d turns = Matrix9d::Zero();
  for (int i = 0; i < 9; i += 3) turns.block<3, 3>(i, i) = turn.toRotationMatrix();
  pose.covariance = turns * pose.covariance * turns.transpose();
  return pose;
}

Setpoint Turned(Setpoint setpoint, double yaw) {
  setpoint.R_WB = math::FromYaw(yaw) * setpoint.R_WB;
  return setpoint;
}

double ThrustShare(double thrust, double hover, double curve) {
  const double at_hover = curve * hover * hover + (1.0 - curve) * hover;
  const double share = std::max(0.0, thrust / kGravity * at_hover);
  const double b = 1.0 - curve;
  // curve u^2 + b u = share, in the form that is exact for curve = 0 as well.
  const double root = std::sqrt(b * b + 4.0 * curve * share);
  const double u = root + b > 0.0 ? 2.0 * share / (root + b) : 0.0;
  return std::clamp(u, 0.0, 1.0);
}

mav::SetAttitudeTarget AttitudeTarget(const Setpoint& setpoint,
                                      const std::optional<Eigen::Quaterniond>& R_WB,
                                      const FcuConfig& config) {
  mav::SetAttitudeTarget m;
  Set(SwapFrames(setpoint.R_WB), &m.q);
  m.thrust = static_cast<float>(
      setpoint.motors ? ThrustShare(setpoint.thrust, config.hover_thrust, config.motor_curve)
                      : 0.0);
  if (!config.body_rates || !R_WB) {
    // PX4 takes the rate as that about the vertical of the earth frame.
    const Eigen::Vector3d w_ned = SwapWorld(setpoint.R_WB * setpoint.w_WB_B);
    m.type_mask = Bits(Mask::BODY_ROLL_RATE_IGNORE, Mask::BODY_PITCH_RATE_IGNORE);
    m.body_yaw_rate = static_cast<float>(w_ned.z());
    return m;
  }
  Eigen::Vector3d w = setpoint.w_WB_B + RateTowards(*R_WB, setpoint.R_WB, config);
  w = SwapBody(w.cwiseMax(-config.max_rate).cwiseMin(config.max_rate));
  m.type_mask = static_cast<uint8_t>(Mask::ATTITUDE_IGNORE);
  m.body_roll_rate = static_cast<float>(w.x());
  m.body_pitch_rate = static_cast<float>(w.y());
  m.body_yaw_rate = static_cast<float>(w.z());
  return m;
}

mav::Odometry ExternalVision(const Pose& pose, uint8_t resets) {
  mav::Odometry m;
  m.time_usec = static_cast<uint64_t>(pose.utime);
  const Eigen::Vector3f p = SwapWorld(pose.p_WB).cast<float>();
  const Eigen::Vector3f v = SwapBody(pose.R_WB.conjugate() * pose.v_WB).cast<float>();
  const Eigen::Vector3f w = SwapBody(pose.w_WB_B).cast<float>();
  m.x = p.x(), m.y = p.y(), m.z = p.z();
  m.vx = v.x(), m.vy = v.y(), m.vz = v.z();
  m.rollspeed = w.x(), m.pitchspeed = w.y(), m.yawspeed = w.z();
  Set(SwapFrames(pose.R_WB), &m.q);
  SetUpperTriangle(PoseCovariance(pose.covariance), &m.pose_covariance);
  SetUpperTriangle(VelocityCovariance(pose), &m.velocity_covariance);
  m.frame_id = static_cast<uint8_t>(mav::MavFrame::LOCAL_FRD);
  m.child_frame_id = static_cast<uint8_t>(mav::MavFrame::BODY_FRD);
  m.reset_counter = resets;
  m.estimator_type = static_cast<uint8_t>(mav::MavEstimatorType::VIO);  // PX4 refuses LIDAR
  m.quality = pose.degraded ? 50 : 100;
  return m;
}

ImuSample FromMessage(const mav::HighresImu& m) {
  return {static_cast<int64_t>(m.time_usec), SwapBody({m.xacc, m.yacc, m.zacc}),
          SwapBody({m.xgyro, m.ygyro, m.zgyro})};
}

ImuSample FromMessage(const mav::RawImu& m) {
  return {static_cast<int64_t>(m.time_usec),
          kStandardGravity * SwapBody(Eigen::Vector3d(m.xacc, m.yacc, m.zacc)),
          1e-3 * SwapBody(Eigen::Vector3d(m.xgyro, m.ygyro, m.zgyro))};
}

ImuSample FromMessage(const mav::ScaledImu& m) {
  return {static_cast<int64_t>(m.time_boot_ms) * 1000,
          kStandardGravity * SwapBody(Eigen::Vector3d(m.xacc, m.yacc, m.zacc)),
          1e-3 * SwapBody(Eigen::Vector3d(m.xgyro, m.ygyro, m.zgyro))};
}

}  // namespace chase::fcu
