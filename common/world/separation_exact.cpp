// The check of separations in integers: every double is an integer times a power of two, and a
// square root is replaced by an upper bound of that kind.
#include <algorithm>
#include <cmath>

#include "common/math/exact.h"
#include "common/world/separation_check.h"

namespace chase::world {
namespace {

using Eigen::Vector3d;
using math::ExactPolynomial;
using math::MakeExact;
using Integer = ExactPolynomial::Integer;

/// (x / m + m) / 2 rounded up, at least sqrt(x) wherever x >= 0: with y = 1 / m rounded and z at
/// least 1 / y, (x y + z) / 2.
ExactPolynomial RootAbove(const ExactPolynomial& x, double m) {
  const double y = 1.0 / m;
  double z = m;
  while (math::SignAtZero(MakeExact(y) * MakeExact(z) - MakeExact(1.0)) < 0)
    z = std::nextafter(z, HUGE_VAL);
  return MakeExact(0.5) * (x * MakeExact(y) + MakeExact(z));
}

/// Of a number that is about `estimate`.
ExactPolynomial NumberRootAbove(const ExactPolynomial& x, double estimate) {
  return math::SignAtZero(x) == 0 ? x : RootAbove(x, std::sqrt(std::max(1e-200, estimate)));
}

ExactPolynomial Absolute(const ExactPolynomial& x) {
  return math::SignAtZero(x) < 0 ? ExactPolynomial() - x : x;
}

ExactPolynomial Dot(const Vector3d& n, const Curve& curve) {
  ExactPolynomial sum;
  for (int a = 0; a < 3; ++a)
    sum = sum + MakeExact(n[a]) * MakeExact(math::Polynomial(curve.col(a)));
  return sum;
}

ExactPolynomial Dot(const Vector3d& n, const Vector3d& x) { return Dot(n, Curve(x.transpose())); }

ExactPolynomial Quadratic(const Eigen::Matrix3d& M, const Vector3d& n) {
  ExactPolynomial sum;
  for (int a = 0; a < 3; ++a) sum = sum + MakeExact(n[a]) * Dot(n, Vector3d(M.row(a)));
  return sum;
}

ExactPolynomial SupportAbove(const Body& body, const Vector3d& n) {
  if (body.kind == Body::Kind::kEllipsoid)
    return NumberRootAbove(Quadratic(body.shape, n), n.dot(body.shape * n));
  if (body.kind == Body::Kind::kCylinder) {
    const Vector3d across(n.x(), n.y(), 0.0);
    return MakeExact(body.half.x()) * NumberRootAbove(Dot(across, across), across.squaredNorm()) +
           MakeExact(body.half.z()) * Absolute(MakeExact(n.z()));
  }
  ExactPolynomial sum;
  for (int a = 0; a < 3; ++a)
    sum = sum + MakeExact(body.half[a]) * Absolute(Dot(n, Vector3d(body.shape.col(a))));
  return sum;
}

ExactPolynomial UncertaintyAbove(const Separation& s, const Body& body) {
  if (body.sigmas == 0.0) return ExactPolynomial();
  const ExactPolynomial tau = MakeExact(math::Polynomial(Eigen::Vector2d(0.0, 1.0)));
  ExactPolynomial variance;
  for (int k = 2; k >= 0; --k) variance = variance * tau + Quadratic(body.covariance[k], s.normal);
  const double middle = Deviation(body, s.normal, 0.5 * (s.from + s.to));
  return MakeExact(body.sigmas) * RootAbove(variance, std::max(kLeastDeviation, middle));
}

/// p(from + (to - from) t) >= 0 on [0,1], by its Bernstein coefficients, which are times n!
/// sum_j i! / (i - j)! (n - j)! p_j.
bool IsNotNegative(const ExactPolynomial& p, const Separation& s) {
  const ExactPolynomial map =
      MakeExact(s.from) + MakeExact(math::Polynomial(Eigen::Vector2d(0.0, 1.0))) *
                              (MakeExact(s.to) - MakeExact(s.from));
  ExactPolynomial shifted;
  for (size_t k = p.c.size(); k-- > 0;)
    shifted = shifted * map + ExactPolynomial{{p.c[k]}, p.exponent};
  const size_t n = shifted.c.empty() ? 0 : shifted.c.size() - 1;
  std::vector<Integer> factorial = {1};
  for (size_t k = 1; k <= n; ++k) factorial.push_back(factorial.back() * k);
  for (size_t i = 0; i < shifted.c.size(); ++i) {
    Integer b = 0;
    for (size_t j = 0; j <= i; ++j)
      b += factorial[i] / factorial[i - j] * factorial[n - j] * shifted.c[j];
    if (b < 0) return false;
  }
  return true;
}

/// Of numbers whose squares and products stay finite in floating point.
template <class Matrix>
bool IsModerate(const Matrix& m) {
  return m.allFinite() && (m.size() == 0 || m.cwiseAbs().maxCoeff() < 1e100);
}

bool IsUsable(const Ball& ball) { return IsModerate(ball.center) && IsModerate(ball.radius); }

bool IsUsable(const Body& body) {
  bool usable = IsModerate(body.center) && IsModerate(body.shape) && IsModerate(body.half) &&
                body.half.minCoeff() >= 0.0 && body.sigmas >= 0.0 && body.sigmas < 1e100;
  for (const Eigen::Matrix3d& S : body.covariance) usable = usable && IsModerate(S);
  return usable;
}

bool IsKeptOff(const Separation& s, const Ball& ball, const Body& body,
               const ExactPolynomial& taken) {
  const ExactPolynomial radius = MakeExact(ball.radius);
  const ExactPolynomial length = NumberRootAbove(Dot(s.normal, s.normal), s.normal.squaredNorm());
  return IsNotNegative(radius, s) &&
         IsNotNegative(
             Dot(s.normal, ball.center) - Dot(s.normal, body.center) - taken - length * radius, s);
}

}  // namespace

bool IsCertificateExact(const Certificate& certificate, double from, double to, const Ball& drone,
                        const Ball* target, const Body& body) {
  if (!IsWellFormed(certificate, from, to) || !IsUsable(drone) || !IsUsable(body)) return false;
  if (target && !IsUsable(*target)) return false;
  for (const Separation& s : certificate) {
    const ExactPolynomial taken = SupportAbove(body, s.normal) + UncertaintyAbove(s, body);
    if (!IsKeptOff(s, drone, body, taken)) return false;
    if (target && !IsKeptOff(s, *target, body, taken)) return false;
  }
  return true;
}

}  // namespace chase::world
