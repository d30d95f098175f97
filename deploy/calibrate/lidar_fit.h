#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace chase::calibrate {

/// The board as the camera sees it, and the sweep at that time.
struct Plane {
  Eigen::Isometry3d X_CP = Eigen::Isometry3d::Identity();  ///< of the board's frame, z its normal
  Eigen::Vector2d size = Eigen::Vector2d::Zero();          ///< of the board, m
  std::vector<Eigen::Vector3d> points;                     ///< all of the sweep, frame L, m
};

struct LidarFit {
  std::string problem;  ///< why there is none; empty: there is one
  Eigen::Isometry3d X_CL = Eigen::Isometry3d::Identity();
  double rms = 0.0;                                          ///< of points to their planes, m
  Eigen::Vector3d position_sigma = Eigen::Vector3d::Zero();  ///< standard deviations, m
  Eigen::Vector3d rotation_sigma = Eigen::Vector3d::Zero();  ///< about the axes of C, rad
  std::vector<std::vector<Eigen::Vector3d>> used;            ///< points of each plane, frame L
};

/// Pose of the LiDAR in the camera from planes that both see: the points on the board lie in its
/// plane (Zhang and Pless 2004, with robust weights). `guess` is to be within 0.2 m and 10 degrees:
/// it says which points are the board's. Needs normals in three directions.
LidarFit FitLidar(const std::vector<Plane>& planes, const Eigen::Isometry3d& guess);

}  // namespace chase::calibrate
