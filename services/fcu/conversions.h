#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

#include "services/fcu/fcu_config.h"
#include "services/fcu/mavlink.h"

/// Our quantities as messages of MAVLink, and back. Times are microseconds of the host's clock.
namespace chase::fcu {

using Matrix9d = Eigen::Matrix<double, 9, 9>;

struct Pose {
  int64_t utime = 0;
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();  ///< m/s
  Eigen::Quaterniond R_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();  ///< rad/s
  Matrix9d covariance = Matrix9d::Zero();            ///< of (p_WB, v_WB, rotation error in W)
  int32_t epoch = 0;                                 ///< of the frame W
  bool usable = false, degraded = false;
  bool starting = false;  ///< W is not known yet: setpoints are in the frame of before
};

struct Setpoint {
  Eigen::Quaterniond R_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();  ///< feed-forward, rad/s
  double thrust = 0.0;                               ///< over mass, m/s^2
  bool motors = false;
};

/// The same in a frame whose z axis is that of W and in which the x axis of W has this yaw, rad.
Pose Turned(Pose pose, double yaw);
Setpoint Turned(Setpoint setpoint, double yaw);

struct ImuSample {
  int64_t utime = 0;
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< specific force, frame B, m/s^2
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< frame B, rad/s
};

/// The share of full thrust, 0 to 1, that gives `thrust` (over mass, m/s^2): the command `u` gives
/// curve u^2 + (1 - curve) u of the greatest thrust (PX4's THR_MDL_FAC), and gravity at hover.
double ThrustShare(double thrust, double hover, double curve);

/// SET_ATTITUDE_TARGET for PX4. With config.body_rates the attitude loop is closed here, on R_WB as
/// estimated; otherwise, and without an estimate, PX4 closes it and takes the rate about the
/// vertical as feed-forward.
mav::SetAttitudeTarget AttitudeTarget(const Setpoint& setpoint,
                                      const std::optional<Eigen::Quaterniond>& R_WB,
                                      const FcuConfig& config);

/// ODOMETRY as external vision; `resets` counts the changes of the frame W.
mav::Odometry ExternalVision(const Pose& pose, uint8_t resets);

/// Measured acceleration and rate in frame B of each of the three messages. The utime of the result
/// is the message's own stamp, on the autopilot's clock.
ImuSample FromMessage(const mav::HighresImu& m);
ImuSample FromMessage(const mav::RawImu& m);
ImuSample FromMessage(const mav::ScaledImu& m);

}  // namespace chase::fcu
