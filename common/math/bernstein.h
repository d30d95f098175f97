#pragma once

#include "common/math/polynomial.h"

namespace chase::math {

/// Binomial(j, k) / Binomial(n, k) for k <= j <= n: what coefficient k of a power of degree n
/// counts for in Bernstein coefficient j.
double BernsteinShare(int n, int j, int k);

/// Coefficients over [0,1] in the Bernstein basis of degree size() - 1. They bound the polynomial
/// from both sides (convex hull) and the first and last are its values at 0 and 1.
Polynomial PowerToBernstein(const Polynomial& power);
Polynomial BernsteinToPower(const Polynomial& bernstein);

/// The value at t by de Casteljau's scheme.
double EvaluateBernstein(const Polynomial& b, double t);

/// Bernstein coefficients of the two parts [0,t] and [t,1], each over its own [0,1].
void SplitBernstein(const Polynomial& b, double t, Polynomial* left, Polynomial* right);

/// The product of two polynomials in Bernstein form, of the sum of the degrees.
Polynomial BernsteinProduct(const Polynomial& a, const Polynomial& b);

/// The same polynomial written at a higher degree.
Polynomial ElevateBernstein(const Polynomial& b, int degree);

enum class Positivity { kPositive, kNotPositive, kUndecided };

/// Is the polynomial above zero on the whole of [0,1]? `error` bounds the absolute error of every
/// coefficient of `b`. kPositive and kNotPositive are proofs; what lies within rounding of zero is
/// kUndecided.
///
/// Margin: an average 0.5 (x + y) of numbers up to M rounds by at most u M, u = 2^-53, and never
/// leaves [-M, M]. A split at 1/2 puts a coefficient through at most n averages, whose weights do
/// not enlarge the errors they take over. So after `depth` splits every coefficient is off by at
/// most error + depth n u M.
Positivity DecidePositive(const Polynomial& b, double error, int max_depth = 40);

/// Bound on the rounding error of every coefficient of PowerToBernstein(power): the weights
/// C(j,k) / C(n,k) are in [0,1] and carry at most 3 roundings, the sum of n + 1 products n + 1
/// more.
double PowerToBernsteinError(const Polynomial& power);

}  // namespace chase::math
