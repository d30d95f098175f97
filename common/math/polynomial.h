#pragma once

#include <Eigen/Core>

namespace chase::math {

/// Coefficients of a polynomial, lowest power first: p(t) = c0 + c1 t + c2 t^2 + ... Up to degree
/// 31, without heap memory.
using Polynomial = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 32, 1>;

/// p(t) by Horner's rule; 0 for an empty polynomial.
double Evaluate(const Polynomial& p, double t);

/// dp/dt; the zero polynomial for a constant.
Polynomial Derivative(const Polynomial& p);

/// p q.
Polynomial Product(const Polynomial& p, const Polynomial& q);

/// p + scale q.
Polynomial Sum(const Polynomial& p, const Polynomial& q, double scale = 1.0);

/// Number of distinct real roots in (lower, upper] by Sturm's theorem in double precision.
/// Remainders below `tolerance` times the largest coefficient of their dividend count as zero. No
/// tolerance makes this safe: use it where a wrong answer is harmless, and math::IsPositive where
/// it is not.
int CountRootsSturm(const Polynomial& p, double lower = 0.0, double upper = 1.0,
                    double tolerance = 1e-14);

/// C(n, k); 0 outside 0 <= k <= n.
double Binomial(int n, int k);

}  // namespace chase::math
