#pragma once

#include <Eigen/Geometry>

#include "common/world/trajectory.h"

namespace chase::world {

/// A solid of constant shape about c(t); where nothing else is said the ellipsoid
/// { x : (x - c(t))' R (x - c(t)) <= 1 } of Jeon 2021, section II-B.
struct Obstacle {
  int id = 0;
  bool moving = false;
  bool ground = false;  ///< what the target stands on: hides nothing
  Trajectory center;    ///< c(t), frame W, m
  Eigen::Matrix3d shape = Eigen::Matrix3d::Identity();  ///< R, frame W, 1/m^2, positive definite
  enum class Solid { kEllipsoid, kBox, kCylinder };     ///< cylinder: upright
  Solid solid = Solid::kEllipsoid;                      ///< others: the ellipsoid is about it
  /// Box: half edges; cylinder: radius, radius, half height; m.
  Eigen::Vector3d half = Eigen::Vector3d::Zero();
  Eigen::Quaterniond axes = Eigen::Quaterniond::Identity();  ///< of a box, frame W
  /// Of the centre at center.start, m^2, and of its velocity, m^2/s^2; frame W.
  Eigen::Matrix3d position_covariance = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d velocity_covariance = Eigen::Matrix3d::Zero();
  double existence = 1.0;  ///< probability that it is there

  /// ||x - c(t)||_R^2; below 1 inside.
  double SquaredDistance(const Eigen::Vector3d& x, double t) const {
    const Eigen::Vector3d d = x - center.Position(t);
    return d.dot(shape * d);
  }
};

/// min over s in [0,1] of ||(1-s) p + s q - c||_R^2, the feasibility function d of Jeon 2021, eq.
/// (6).
double SegmentSquaredDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& q,
                              const Eigen::Vector3d& c, const Eigen::Matrix3d& R);

/// The ellipsoid grown by `margin` m along each principal axis: within the Minkowski sum with a
/// ball, so it sorts out what is too near, and proves nothing.
Eigen::Matrix3d Inflated(const Eigen::Matrix3d& R, double margin);

/// The same for many margins: axes and radii are worked out once.
class Inflation {
 public:
  explicit Inflation(const Eigen::Matrix3d& R);
  Eigen::Matrix3d By(double margin) const;

 private:
  bool aligned_;  ///< the axes are those of the frame
  Eigen::Matrix3d axes_;
  Eigen::Array3d radius_;
};

}  // namespace chase::world
