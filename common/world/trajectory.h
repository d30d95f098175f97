#pragma once

#include <Eigen/Core>

#include "common/world/state.h"

namespace chase::world {

/// Position over an interval as a polynomial of normalised time tau = (t - start) / duration.
/// Row k of `coefficients` belongs to tau^k; columns x y z in frame W, m.
struct Trajectory {
  double start = 0.0;     ///< s
  double duration = 1.0;  ///< s, > 0
  Eigen::Matrix<double, Eigen::Dynamic, 3> coefficients = Eigen::MatrixXd::Zero(1, 3);

  int degree() const { return static_cast<int>(coefficients.rows()) - 1; }
  double end() const { return start + duration; }

  /// Derivative of the given order with respect to t at time t [m/s^order]. Evaluates the
  /// polynomial as it is, also outside the interval.
  Eigen::Vector3d Derivative(int order, double t) const;
  Eigen::Vector3d Position(double t) const { return Derivative(0, t); }
  Eigen::Vector3d Velocity(double t) const { return Derivative(1, t); }
  Eigen::Vector3d Acceleration(double t) const { return Derivative(2, t); }
  State At(double t) const;

  /// The same motion over [new_start, new_start + new_duration].
  Trajectory Reparametrised(double new_start, double new_duration) const;

  /// A point at rest.
  static Trajectory Constant(const Eigen::Vector3d& p, double start, double duration);
};

}  // namespace chase::world
