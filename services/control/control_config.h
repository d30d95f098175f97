#pragma once

#include <Eigen/Core>
#include <string>

#include "common/world/geofence.h"

namespace chase::control {

/// Gains and limits of the controller. Per-axis values are in frame W.
struct ControlConfig {
  Eigen::Vector3d position_gain = {6.0, 6.0, 6.0};  ///< 1/s^2
  Eigen::Vector3d velocity_gain = {4.0, 4.0, 4.0};  ///< 1/s
  Eigen::Vector3d integral_gain = {1.5, 1.5, 2.0};  ///< 1/s^3
  double integral_limit = 1.5;                      ///< per axis, m/s^2
  double catch_up_speed = 2.0;                      ///< m/s
  Eigen::Vector3d drag = {0.25, 0.25, 0.15};        ///< 1/s
  double tilt_limit_deg = 35.0;
  double min_thrust = 2.0;      ///< m/s^2
  double max_thrust = 18.0;     ///< m/s^2
  double max_body_rate = 4.0;   ///< rad/s
  double max_yaw_error = 0.8;   ///< rad
  double lead = 0.02;           ///< s
  double drone_radius = 0.25;   ///< m
  double tracking_tube = 0.12;  ///< m
  double sigmas = 2.0;
  double reset_distance = 0.3;  ///< m
  double land_speed = 0.45;     ///< m/s
  double lost_descent = 0.1;    ///< m/s^2
  world::Geofence geofence;

  template <class V>
  void Visit(V& v) {
    v("position_gain", position_gain, "acceleration per position error, x y z, 1/s^2");
    v("velocity_gain", velocity_gain, "acceleration per velocity error, x y z, 1/s");
    v("integral_gain", integral_gain, "growth of the integral per position error, x y z, 1/s^3");
    v("integral_limit", integral_limit, "bound of the integral on each axis, m/s^2");
    v("catch_up_speed", catch_up_speed, "speed at which a large position error is closed, m/s");
    v("drag", drag, "linear drag over mass that is fed forward, x y z, 1/s");
    v("tilt_limit_deg", tilt_limit_deg, "between the desired thrust and the vertical");
    v("min_thrust", min_thrust, "collective thrust over mass, m/s^2");
    v("max_thrust", max_thrust, "collective thrust over mass, m/s^2");
    v("max_body_rate", max_body_rate, "bound of the feed-forward on each axis, rad/s");
    v("max_yaw_error", max_yaw_error, "largest step of yaw asked for at once, rad");
    v("lead", lead, "the plan's acceleration and yaw are taken this much ahead: attitude lag, s");
    v("drone_radius", drone_radius, "of the sphere that plans have to keep clear, m");
    v("tracking_tube", tracking_tube, "about it: the body stays this near to the plan, m");
    v("sigmas", sigmas, "plans have to take the obstacles' covariances by so many deviations");
    v("reset_distance", reset_distance,
      "a new plan starts this near to the reference or to the body, m");
    v("land_speed", land_speed,
      "of sinking to land, asked for or by the inertial velocity once the pose is lost, m/s; its "
      "loop goes a tenth beyond");
    v("lost_descent", lost_descent, "thrust short of hovering where there is no velocity, m/s^2");
    v("geofence", geofence, "plans that leave it are not flown; none: mission's");
  }

  /// The least that a proof has to keep clear, m.
  double hard_radius() const { return drone_radius + tracking_tube; }
  /// Standard deviation of the velocity up to which it is used, m/s. Without one, thrust that is
  /// wrong by `lost_descent` leads to this speed, where drag balances it.
  double UsableVelocitySigma() const { return lost_descent / drag.z(); }
  std::string Problem() const;
};

}  // namespace chase::control
