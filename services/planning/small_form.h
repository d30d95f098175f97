#pragma once

#include <Eigen/Core>

#include "common/math/bernstein.h"

namespace chase::planning {

/// A polynomial of degree up to 12 in Bernstein form over [0,1] with a bound on the error of its
/// coefficients: d_p - 1, d_q - 1 or d_s - 1 of one obstacle.
struct SmallForm {
  double b[13];
  double error;
};

/// x' R y - 1 for control points x and y of degree n <= 6, relative to the centre. Every coordinate
/// of x is at most X in magnitude and off by at most (n + 10) u X, u = 2^-53, and so for y. Terms
/// w_ij x_i' R y_j with weights that sum to 1 over i + j = k are at most X Y sum|R_ab| in sum, 7 +
/// n roundings and 4 for the weight on top: less than 64 u (1 + X Y sum|R_ab|) in all.
SmallForm MakeForm(int n, const double (*x)[3], double X, const Eigen::Matrix3d& R,
                   const double (*y)[3], double Y);

/// The part on [from, 1]; `degree` is that of the form.
void CutFrom(int degree, double from, SmallForm* f);

/// P > 0 on [0,1].
math::Positivity DecideSafe(int degree, const SmallForm& P, int depth);

/// P, Q > 0 and (`exact`: S > 0 or P Q > S^2; else S > 0) on [0,1], by joint subdivision: on a
/// piece with lower bounds p, q, s, fine if s > 0, or if p q > s^2. Broken where an end shows it.
math::Positivity DecideSight(int degree, const SmallForm& P, const SmallForm& Q, const SmallForm& S,
                             bool exact, int depth);

}  // namespace chase::planning
