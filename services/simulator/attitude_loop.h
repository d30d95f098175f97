#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>

#include "services/simulator/quadrotor.h"

namespace chase::simulator {

/// What the flight controller is asked to fly.
struct AttitudeSetpoint {
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< desired R_WB
  Eigen::Vector3d body_rate = Eigen::Vector3d::Zero();  ///< feed-forward, in the desired B, rad/s
  double thrust = 0.0;                                  ///< collective over mass, m/s^2
  bool motors = true;                                   ///< false: they stand still
};

/// Gains of the inner loop, after PX4's defaults for a small quadrotor.
struct AttitudeLoopConfig {
  Eigen::Vector3d attitude_gain = {6.5, 6.5, 2.8};
  Eigen::Vector3d rate_gain = {22.0, 22.0, 8.0};
  Eigen::Vector3d rate_integral = {10.0, 10.0, 4.0};
  Eigen::Vector3d rate_derivative = {0.1, 0.1, 0.0};
  Eigen::Vector3d max_rate = {3.84, 3.84, 3.49};

  template <class V>
  void Visit(V& v) {
    v("attitude_gain", attitude_gain, "roll pitch yaw, 1/s");
    v("rate_gain", rate_gain, "roll pitch yaw, 1/s");
    v("rate_integral", rate_integral, "roll pitch yaw, 1/s^2");
    v("rate_derivative", rate_derivative, "roll pitch yaw, of the measured rate");
    v("max_rate", max_rate, "roll pitch yaw, rad/s");
  }
  std::string Problem() const;
};

/// PX4's cascade: quaternion attitude error times a gain plus the feed-forward gives the rate
/// wanted (250 Hz); a PID of the body rate gives the torque (1 kHz).
class AttitudeLoop {
 public:
  AttitudeLoop(const AttitudeLoopConfig& config, const Eigen::Vector3d& inertia)
      : config_(config), inertia_(inertia) {}

  /// One step of dt = 1 ms. The integral rests while the vehicle stands on the ground.
  Wrench Step(const AttitudeSetpoint& setpoint, const BodyState& state, bool on_ground, double dt);
  void Reset();

 private:
  Eigen::Vector3d RateWanted(const AttitudeSetpoint& setpoint, const BodyState& state) const;

  AttitudeLoopConfig config_;
  Eigen::Vector3d inertia_;
  Eigen::Vector3d rate_wanted_ = Eigen::Vector3d::Zero(), integral_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d last_rate_ = Eigen::Vector3d::Zero(), slope_ = Eigen::Vector3d::Zero();
  int steps_ = 0;
};

}  // namespace chase::simulator
