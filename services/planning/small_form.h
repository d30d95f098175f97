#pragma once

#include <Eigen/Core>

#include "common/math/bernstein.h"

namespace chase::planning {

/// d_p - 1, d_q - 1 and d_s - 1 of one obstacle over [0,1] side by side, of degree 2n <= 12 in
/// Bernstein form, with a bound on the error of their coefficients.
///
/// From control points x of the plan and y of the target, degree n <= 6, relative to the centre:
/// every coordinate of x is at most X in magnitude and off by at most (n + 10) u X, u = 2^-53, and
/// so for y. The coefficients are means of x' R x, y' R y, x' R y, sums of terms below X Y
/// sum|R_ab| that take 7 + n roundings and 4 for the weight: less than 64 u (1 + X Y sum|R_ab|) in
/// all.
class SmallForms {
 public:
  SmallForms(int n, const double (*x)[3], double X, const double (*y)[3], double Y,
             const Eigen::Matrix3d& R);

  /// The part on [from, 1].
  void CutFrom(double from);

  /// d_p > 1 on all of it.
  math::Positivity DecideSafe(int depth) const;

  /// d_p, d_q > 1 and (`exact`: d_s > 1 or (d_p - 1)(d_q - 1) > (d_s - 1)^2; else d_s > 1) on all
  /// of it, by joint subdivision: on a piece with lower bounds p, q, s, fine if s > 0, or if
  /// p q > s^2. Broken where an end shows it.
  math::Positivity DecideSight(bool exact, int depth) const;

 private:
  friend class FormDecision;
  int degree_;
  double root_[13][4];  // coefficients of P, Q, S, unused
  double error_[4];
  double step_[4];  // error that a split adds: every average rounds by at most u times the largest
};

}  // namespace chase::planning
