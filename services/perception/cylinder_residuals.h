#pragma once

#include <ceres/jet.h>

#include <Eigen/Core>

#include "services/perception/cylinder_fit.h"

namespace chase::perception {

// Residuals over x = (p_WT, v_WT) [m, m/s] and s = (radius, height) [m].

/// A line of sight in the plan view: it leaves the camera at c_xy towards the unit vector d_xy and
/// climbs `slope` metres a metre.
struct PlanRay {
  Eigen::Vector3d c;          ///< p_WC, frame W, m
  Eigen::Vector2d direction;  ///< unit, frame W
  double slope = 0.0;
};

/// The line of sight touches the side of the cylinder: in the plan view the axis passes it at one
/// radius, to the right of a left edge, to the left of a right edge.
struct SideResidual {
  PlanRay ray;
  double sign;   ///< +1: right edge, -1: left edge
  double scale;  ///< 1/m

  template <class T>
  bool operator()(const T* x, const T* s, T* residual) const {
    const T ax = x[0] - ray.c.x(), ay = x[1] - ray.c.y();
    const T cross = ray.direction.x() * ay - ray.direction.y() * ax;
    residual[0] = scale * (sign * cross - s[0]);
    return true;
  }
};

/// The line of sight touches the rim of the top or bottom. Seen from above, the top's outline is
/// its far rim and the bottom's its near rim; seen from below the other way round.
struct CapResidual {
  PlanRay ray;
  double sign;   ///< +1: top edge, -1: bottom edge
  double scale;  ///< 1/m

  template <class T>
  bool operator()(const T* x, const T* s, T* residual) const {
    using std::sqrt;
    const T ax = x[0] - ray.c.x(), ay = x[1] - ray.c.y();
    const T along = ray.direction.x() * ax + ray.direction.y() * ay;
    const T cross = ray.direction.x() * ay - ray.direction.y() * ax;
    const T rim = x[2] + sign * 0.5 * s[1];
    const T inside = s[0] * s[0] - cross * cross;
    const T chord = inside > 0.05 * s[0] * s[0] ? T(sqrt(inside)) : T(sqrt(0.05) * s[0]);
    const bool above = T(ray.c.z()) > rim;
    const T reach = above == (sign > 0.0) ? T(along + chord) : T(along - chord);
    residual[0] = scale * sign * (ray.c.z() + ray.slope * reach - rim);
    return true;
  }
};

/// Distance of a LiDAR point from the surface of the cylinder where it stood at the point's time.
struct PointResidual {
  Eigen::Vector3d p_W;
  double age;    ///< s
  double scale;  ///< 1/m

  template <class T>
  bool operator()(const T* x, const T* s, T* residual) const {
    using std::abs;
    using std::sqrt;
    const T qx = p_W.x() - (x[0] - age * x[3]), qy = p_W.y() - (x[1] - age * x[4]);
    const T qz = p_W.z() - (x[2] - age * x[5]);
    const T side = sqrt(qx * qx + qy * qy + 1e-12) - s[0];
    const T cap = abs(qz) - 0.5 * s[1];
    if (side > 0.0 && cap > 0.0)
      residual[0] = scale * sqrt(side * side + cap * cap);
    else
      residual[0] = scale * (side > cap ? side : cap);
    return true;
  }
};

/// A position measured as such.
struct PositionResidual {
  Eigen::Vector3d p_W;
  Eigen::Matrix3d root_information;  ///< L' L is the inverse covariance, 1/m^2

  template <class T>
  bool operator()(const T* x, T* residual) const {
    Eigen::Map<const Eigen::Matrix<T, 3, 1>> p(x);
    Eigen::Map<Eigen::Matrix<T, 3, 1>> r(residual);
    r = root_information.cast<T>() * (p - p_W.cast<T>());
    return true;
  }
};

/// Deviation from a Gaussian in whitened units.
template <int N>
struct PriorResidual {
  Eigen::Matrix<double, N, 1> mean;
  Eigen::Matrix<double, N, N> root_information;

  template <class T>
  bool operator()(const T* x, T* residual) const {
    Eigen::Map<const Eigen::Matrix<T, N, 1>> value(x);
    Eigen::Map<Eigen::Matrix<T, N, 1>> r(residual);
    r = root_information.template cast<T>() * (value - mean.template cast<T>());
    return true;
  }
};

}  // namespace chase::perception
