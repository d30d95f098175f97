#pragma once

#include <Eigen/Core>

#include "common/world/trajectory.h"

namespace chase::world {

/// The ellipsoid { x : (x - c(t))' R (x - c(t)) <= 1 } of constant shape R. Jeon 2021, section
/// II-B.
struct Obstacle {
  int id = 0;
  bool moving = false;
  Trajectory center;                                    ///< c(t), frame W, m
  Eigen::Matrix3d shape = Eigen::Matrix3d::Identity();  ///< R, frame W, 1/m^2, positive definite
  double position_variance = 0.0;                       ///< isotropic, m^2
  double velocity_variance = 0.0;                       ///< isotropic, m^2/s^2

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

/// The ellipsoid grown by `margin` m along each principal axis (encloses the Minkowski sum's axes).
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
