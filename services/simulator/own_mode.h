#pragma once

#include <Eigen/Geometry>

#include "services/simulator/attitude_loop.h"

namespace chase::simulator {

/// What the autopilot knows of the body that it flies; W is its own world frame, with z up.
struct Px4Body {
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero(), v_WB = Eigen::Vector3d::Zero();  ///< m, m/s
  Eigen::Quaterniond R_WB = Eigen::Quaterniond::Identity();
  bool knows_velocity = true;                      ///< the level one, and so the position
  int resets = 0;                                  ///< times that W was begun anew
  Eigen::Vector3d accel = {0.0, 0.0, 9.81};        ///< specific force measured, frame B, m/s^2
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();  ///< measured, frame B, rad/s
  bool touches = true;                             ///< the ground
  double thrust = 0.0;                             ///< over mass, m/s^2
  double hover_thrust = 9.81;                      ///< asked for, that balances gravity, m/s^2
  double charge = 0.8;                             ///< of the battery, 0 to 1
};

/// PX4's Hold and Land, which stay where they began, and Descend, which takes over where the
/// velocity is not known: level, down.
class OwnMode {
 public:
  explicit OwnMode(const Px4Body& body);
  /// In the autopilot's frame. On the ground the motors idle.
  AttitudeSetpoint Demand(const Px4Body& body, bool lands) const;
  /// Does its place mean what it meant when it began?
  bool Holds(const Px4Body& body) const { return body.resets == resets_; }

 private:
  Eigen::Vector3d Push(const Px4Body& body) const;

  Eigen::Vector3d p_;
  double yaw_;
  int resets_;
};

}  // namespace chase::simulator
