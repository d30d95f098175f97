#pragma once

#include <Eigen/Geometry>

#include "common/world/state.h"
#include "services/control/control_config.h"
#include "services/control/drag_estimate.h"
#include "services/control/thrust_gain.h"

namespace chase::control {

/// What the body should be doing at one instant. Frame W.
struct Reference {
  world::State state;
  double yaw = 0.0;       ///< rad
  double yaw_rate = 0.0;  ///< rad/s
};

/// What odometry says the body does.
struct Estimate {
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();  ///< m/s
  Eigen::Quaterniond R_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d a_WB = Eigen::Vector3d::Zero();  ///< without gravity, m/s^2
  double velocity_sigma = 0.0;                     ///< along the axis where it is largest, m/s
};

/// What the attitude loop is asked for.
struct Setpoint {
  Eigen::Quaterniond R_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();  ///< feed-forward, rad/s
  double thrust = 9.81;                              ///< collective over mass, m/s^2
  bool motors = true;                                ///< false: off
};

constexpr double kGravity = 9.81;  ///< m/s^2

/// Specific thrust (acceleration without gravity, m/s^2, frame W) cut to what may be asked for: the
/// vertical part first, within [min_thrust, max_thrust], then the horizontal part within the tilt
/// and what the vertical leaves of max_thrust. Never zero: free fall has no attitude.
Eigen::Vector3d LimitThrust(const Eigen::Vector3d& thrust, const ControlConfig& config);

/// Attitude with z_B along `thrust` and the nose towards `yaw`, and the angular velocity w_WB_B at
/// which it turns while `thrust` changes by `thrust_rate` (m/s^3) and yaw by `yaw_rate`.
/// Lee, Leok, McClamroch 2010, section IV; Mellinger, Kumar 2011, section III. `thrust` must not be
/// horizontal.
Setpoint AttitudeFor(const Eigen::Vector3d& thrust, const Eigen::Vector3d& thrust_rate, double yaw,
                     double yaw_rate);

/// Lee's position loop, with an integral, feed-forward of drag and limits. Thrusts are asked for by
/// what the motors have been seen to give.
class TrackingLaw {
 public:
  explicit TrackingLaw(const ControlConfig& config)
      : config_(config), drag_(0.5 * (config.drag.x() + config.drag.y())) {}

  /// `now` gives position and velocity to compare with the estimate, `ahead` the acceleration, jerk
  /// and yaw fed forward. `dt` is the time since the last call, s: 0 leaves the integral alone.
  Setpoint Track(const Estimate& estimate, const Reference& now, const Reference& ahead, double dt);

  /// Against the velocity and the wind, to rest, within the limits: needs no position.
  Setpoint Brake(const Estimate& estimate, double yaw) const;

  /// The same across, and thrust `lift` (m/s^2) beyond that of hovering.
  Setpoint Sink(const Estimate& estimate, double yaw, double lift) const;

  /// Level attitude at the given yaw, thrust `lift` beyond that of hovering.
  Setpoint Level(double yaw, double lift) const;

  /// Frame W has turned by `yaw`, rad.
  void Turn(double yaw);

  /// Thrust over mass that the motors give for what they are asked, shares of it.
  double thrust_gain() const { return airborne_ ? gain_.value() : 1.0; }

  /// What the integral has asked for on average, horizontally, against a wind, m/s^2.
  const Eigen::Vector3d& trim() const { return trim_; }

  /// Acceleration that the integral asks for, m/s^2.
  const Eigen::Vector3d& integral() const { return integral_; }

 private:
  Eigen::Vector3d Feedback(const Estimate& estimate, const world::State& reference) const;
  void Integrate(const Eigen::Vector3d& position_error, double dt);
  void Learn(const Estimate& estimate, double dt);
  void Weigh(const Eigen::Vector3d& force, const Estimate& estimate, double dt);
  double Asked(double thrust) const;
  double AlongBody(const Eigen::Vector3d& thrust, const Estimate& estimate) const;

  ControlConfig config_;
  Eigen::Vector3d integral_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d trim_ = Eigen::Vector3d::Zero();
  ThrustGain gain_;
  DragEstimate drag_;
  double asked_ = kGravity;  // last, m/s^2
  double followed_ = 0.0;    // plans, for this long, s
  bool airborne_ = false;    // on the ground it is not the motors alone that bear the weight
};

}  // namespace chase::control
