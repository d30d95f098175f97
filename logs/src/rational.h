#pragma once

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "chase/polynomial_t.hpp"

/// Arithmetic without rounding for the check of plans, from the numbers of messages on.
namespace chase::logs::exact {

using Rational = boost::multiprecision::cpp_rational;
using Vector = std::array<Rational, 3>;
using Matrix = std::array<Vector, 3>;  // rows
using Curve = std::vector<Vector>;     // coefficients of 1, tau, tau^2, ...

/// Why a message is refused.
struct Fault {
  std::string what;
};
inline void Ask(bool holds, const char* what) {
  if (!holds) throw Fault{what};
}

Rational Exact(double x);
inline Rational Seconds(int64_t utime) { return Rational(utime, 1000000); }
Vector ToVector(const double* v);
Matrix ToMatrix(const double (&m)[9]);
Matrix ToMatrix(const double (&m)[6]);  ///< xx xy xz yy yz zz

Rational Dot(const Vector& a, const Vector& b);
Vector Times(const Matrix& M, const Vector& v);
Vector Minus(const Vector& a, const Vector& b);
/// Of a symmetric matrix that has to be positive definite.
Matrix Inverse(const Matrix& R);
/// At least the square root, above it by 2^-80 at most.
Rational RootAbove(const Rational& x);

/// x(a + b s) by powers of s.
Curve Substitute(const Curve& x, const Rational& a, const Rational& b);
Curve ToCurve(const polynomial_t& m);
/// By normalised time of another interval.
Curve Over(const polynomial_t& m, const polynomial_t& interval);

/// A curve by its Bernstein coefficients over parts of [0, 1], each part worked out once.
class Pieces {
 public:
  Pieces(Curve x, size_t degree) : x_(std::move(x)), n_(degree) { x_.resize(n_ + 1); }
  const Curve& On(const Rational& from, const Rational& to);

 private:
  Curve x_;
  size_t n_;
  std::map<std::pair<Rational, Rational>, Curve> pieces_;
};

}  // namespace chase::logs::exact
