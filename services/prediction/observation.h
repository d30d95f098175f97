#pragma once

#include <Eigen/Core>

namespace chase::prediction {

/// One observed position of the target, N(mean, covariance) at time t. Frame W.
struct Observation {
  double t = 0.0;                                            ///< s
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();            ///< m
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  ///< m^2, positive definite
};

}  // namespace chase::prediction
