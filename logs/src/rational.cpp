#include "logs/src/rational.h"

#include <cmath>

namespace chase::logs::exact {

using Integer = boost::multiprecision::cpp_int;

Rational Exact(double x) {
  Ask(std::isfinite(x), "holds a number that is none");
  return Rational(x);
}
Vector ToVector(const double* v) { return {Exact(v[0]), Exact(v[1]), Exact(v[2])}; }
Matrix ToMatrix(const double (&m)[9]) { return {ToVector(m), ToVector(m + 3), ToVector(m + 6)}; }
Matrix ToMatrix(const double (&m)[6]) {
  return ToMatrix({m[0], m[1], m[2], m[1], m[3], m[4], m[2], m[4], m[5]});
}
Rational Dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector Times(const Matrix& M, const Vector& v) {
  return {Dot(M[0], v), Dot(M[1], v), Dot(M[2], v)};
}
Vector Minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

Rational RootAbove(const Rational& x) {
  Ask(x >= 0, "holds a covariance or a shape that is none");
  if (x == 0) return 0;
  return Rational(sqrt((numerator(x) << 160) / denominator(x)) + 1, Integer(1) << 80);
}

Curve Substitute(const Curve& x, const Rational& a, const Rational& b) {
  Curve y(x.size());
  for (size_t k = x.size(); k-- > 0;)
    for (size_t axis = 0; axis < 3; ++axis) {
      for (size_t i = x.size(); i-- > 1;) y[i][axis] = a * y[i][axis] + b * y[i - 1][axis];
      y[0][axis] = a * y[0][axis] + x[k][axis];
    }
  return y;
}
Curve ToCurve(const polynomial_t& m) {
  Ask(m.n_coefficients >= 3 && m.n_coefficients % 3 == 0 && m.n_coefficients <= 48 &&
          m.duration > 0.0,
      "is no curve");
  Curve x;
  for (size_t k = 0; k < m.coefficients.size(); k += 3) x.push_back(ToVector(&m.coefficients[k]));
  return x;
}
Curve Over(const polynomial_t& m, const polynomial_t& interval) {
  const Curve x = ToCurve(m);
  if (x.size() == 1) return x;
  const Rational T = Exact(m.duration);
  return Substitute(x, (Seconds(interval.utime) - Seconds(m.utime)) / T,
                    Exact(interval.duration) / T);
}

namespace {
Vector Cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
}  // namespace

Matrix Inverse(const Matrix& R) {
  const Matrix minors = {Cross(R[1], R[2]), Cross(R[2], R[0]), Cross(R[0], R[1])};
  const Rational det = Dot(R[0], minors[0]);
  Ask(R[0][0] > 0 && minors[2][2] > 0 && det > 0, "holds a shape that is none");
  Matrix inverse = minors;  // symmetric, as R is
  for (Vector& row : inverse)
    for (Rational& x : row) x /= det;
  return inverse;
}

const Curve& Pieces::On(const Rational& from, const Rational& to) {
  Curve& b = pieces_[{from, to}];
  if (!b.empty()) return b;
  b = Substitute(x_, from, to - from);
  // b_i = sum_j C(i,j) / C(n,j) x_j is n steps of sums after a division.
  Rational choose = 1;
  for (size_t j = 1; j <= n_; ++j) {
    choose = choose * (n_ - j + 1) / j;
    for (Rational& x : b[j]) x /= choose;
  }
  for (size_t step = 1; step <= n_; ++step)
    for (size_t i = n_; i >= step; --i)
      for (size_t axis = 0; axis < 3; ++axis) b[i][axis] += b[i - 1][axis];
  return b;
}

}  // namespace chase::logs::exact
