#pragma once

#include <Eigen/Core>

#include "common/world/trajectory.h"

namespace chase::planning {

/// The newest forecast of the target. Times in seconds from the pilot's origin.
struct Forecast {
  double t = 0.0;                                                 ///< made for this instant, s
  bool has_target = false;                                        ///< false: nothing to chase
  world::Trajectory target;                                       ///< p_WT(t)
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();           ///< of the position at t, m^2
  Eigen::Matrix3d velocity_covariance = Eigen::Matrix3d::Zero();  ///< and velocity, m^2/s^2
  double radius = 0.0, height = 0.0;  ///< of the target's upright cylinder, m; 0: not known
};

/// The body as estimated, frame W.
struct BodyEstimate {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  ///< p_WB, m
  Eigen::Vector3d v = Eigen::Vector3d::Zero();  ///< v_WB, m/s
  double yaw = 0.0;                             ///< rad
  /// Against the map around: of p, m^2, and of v, m^2/s^2.
  Eigen::Matrix3d position_covariance = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d velocity_covariance = Eigen::Matrix3d::Zero();
};

}  // namespace chase::planning
