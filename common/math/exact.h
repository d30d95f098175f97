#pragma once

#include <boost/multiprecision/cpp_int.hpp>
#include <vector>

#include "common/math/polynomial.h"

namespace chase::math {

/// A polynomial in exact arithmetic: sum_k c[k] 2^exponent t^k. Every finite double is such a
/// number, and sums and products stay so, without fractions.
struct ExactPolynomial {
  using Integer = boost::multiprecision::cpp_int;
  std::vector<Integer> c;  ///< lowest power first; empty: zero
  int exponent = 0;
};

/// The exact value of the given (finite) doubles.
ExactPolynomial MakeExact(const Polynomial& p);
ExactPolynomial MakeExact(double value);

ExactPolynomial operator+(const ExactPolynomial& a, const ExactPolynomial& b);
ExactPolynomial operator-(const ExactPolynomial& a, const ExactPolynomial& b);
ExactPolynomial operator*(const ExactPolynomial& a, const ExactPolynomial& b);

/// Sign of the value at 0 and at 1.
int SignAtZero(const ExactPolynomial& p);
int SignAtOne(const ExactPolynomial& p);

/// Number of distinct real roots in (0, 1], multiple ones counted once; -1 for the zero polynomial.
/// Sturm's theorem over the integers (primitive remainder sequence).
int CountRootsExact(const ExactPolynomial& p);
int CountRootsExact(const Polynomial& p);

/// Is p > 0 on the whole of [0,1]? Exact.
bool IsPositiveExact(const ExactPolynomial& p);

/// The same for doubles: a proven floating-point filter first, exact arithmetic for what it leaves
/// open. NaN and infinity are not positive.
bool IsPositive(const Polynomial& p);

/// On all of [0,1]: P > 0, Q > 0, and S > 0 or P Q > S^2. Then (1-s)^2 P + 2 s (1-s) S + s^2 Q > 0
/// for s in [0,1]: with P = d_p - 1, Q = d_q - 1, S = d_s - 1 of Jeon 2021, proposition 2, exactly
/// the condition that the line of sight misses the obstacle. Exact.
bool IsSightClearExact(const ExactPolynomial& P, const ExactPolynomial& Q,
                       const ExactPolynomial& S);

}  // namespace chase::math
