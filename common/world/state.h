#pragma once

#include <Eigen/Core>

namespace chase::world {

/// Translational state of the drone. Frame W.
struct State {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  ///< p_WB, m
  Eigen::Vector3d v = Eigen::Vector3d::Zero();  ///< v_WB, m/s
  Eigen::Vector3d a = Eigen::Vector3d::Zero();  ///< a_WB, m/s^2
  Eigen::Vector3d j = Eigen::Vector3d::Zero();  ///< jerk, m/s^3
};

}  // namespace chase::world
