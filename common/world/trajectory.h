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

/// Coefficients of `trajectory` over [start, start + duration] in normalised time.
template <class Coefficients>
void SetCurve(const Trajectory& trajectory, double start, double duration, Coefficients* curve) {
  const double a = (start - trajectory.start) / trajectory.duration;
  const double b = duration / trajectory.duration;
  *curve = trajectory.coefficients;
  if (curve->rows() == 1 || (a == 0.0 && b == 1.0)) return;
  // tau = a + b sigma: sum_k c_k (a + b sigma)^k by Horner's rule on polynomials.
  Coefficients& c = *curve;
  c.setZero();
  const Eigen::Index n = c.rows() - 1;
  for (Eigen::Index k = n; k >= 0; --k) {
    for (Eigen::Index i = n; i > 0; --i) c.row(i) = a * c.row(i) + b * c.row(i - 1);
    c.row(0) = a * c.row(0) + trajectory.coefficients.row(k);
  }
}

}  // namespace chase::world
