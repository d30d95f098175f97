#include "common/world/separation_check.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace chase::world {
namespace {

using Eigen::Vector3d;

constexpr double kNothing = -HUGE_VAL;
constexpr double kRounding = 0x1p-53;
constexpr int kTerms = 16;

/// A polynomial in the power basis whose coefficients are within roundings * kRounding * size of
/// the true ones, where size bounds the sum of the absolute values of all that is added up.
struct Form {
  double f[kTerms] = {};
  double size = 0.0;

  void Add(int k, double value, double magnitude) {
    f[k] += value;
    size += magnitude;
  }
};

bool IsUsable(const Separation& s) {
  const double squared = s.normal.squaredNorm();
  return s.from >= 0.0 && s.from < s.to && s.to <= 1.0 && squared >= 0.5 && squared <= 2.0;
}

/// n' M n and the sum of the absolute values of its terms.
double Quadratic(const Eigen::Matrix3d& M, const Vector3d& n, double* magnitude) {
  const Vector3d absolute = n.cwiseAbs();
  *magnitude = absolute.dot(M.cwiseAbs() * absolute);
  return n.dot(M * n);
}

/// Adds minus the support of the solid.
void AddSolid(const Body& body, const Vector3d& n, Form* form) {
  const Vector3d absolute = n.cwiseAbs();
  double magnitude = 0.0;
  switch (body.kind) {
    case Body::Kind::kEllipsoid: {
      const double squared = Quadratic(body.shape, n, &magnitude);
      const double h = std::sqrt(squared + 16.0 * kRounding * magnitude);  // rounded up
      return form->Add(0, -h, h);
    }
    case Body::Kind::kBox:
      for (int a = 0; a < 3; ++a) {
        magnitude = absolute.dot(body.shape.col(a).cwiseAbs()) * body.half[a];
        form->Add(0, -std::abs(n.dot(body.shape.col(a))) * body.half[a], magnitude);
      }
      return;
    case Body::Kind::kCylinder: {
      const double h = body.half.x() * n.head<2>().norm() + body.half.z() * absolute.z();
      return form->Add(0, -h, h);
    }
  }
}

/// Adds minus an upper bound of sigmas sqrt(n' S(tau) n): sqrt(x) <= (x / m + m) / 2 for every m,
/// tight where m = sqrt(x).
void AddUncertainty(const Separation& s, const Body& body, Form* form) {
  if (body.sigmas == 0.0) return;
  double squared[3], magnitude[3];
  for (int k = 0; k < 3; ++k) squared[k] = Quadratic(body.covariance[k], s.normal, &magnitude[k]);
  const double tau = 0.5 * (s.from + s.to);
  const double variance = (squared[2] * tau + squared[1]) * tau + squared[0];
  const double m = std::max(kLeastDeviation, std::sqrt(std::max(0.0, variance)));
  const double half = 0.5 * body.sigmas;
  for (int k = 0; k < 3; ++k) form->Add(k, -half * squared[k] / m, half * magnitude[k] / m);
  form->Add(0, -half * m, half * m);
}

/// Adds n' curve with the sign; false where the degree is too high.
bool AddCurve(const Curve& curve, const Vector3d& n, double sign, Form* form) {
  if (curve.rows() > kTerms) return false;
  const Vector3d absolute = n.cwiseAbs();
  for (int k = 0; k < curve.rows(); ++k)
    form->Add(k, sign * (n.x() * curve(k, 0) + n.y() * curve(k, 1) + n.z() * curve(k, 2)),
              absolute.x() * std::abs(curve(k, 0)) + absolute.y() * std::abs(curve(k, 1)) +
                  absolute.z() * std::abs(curve(k, 2)));
  return true;
}

/// C(i,j) / C(n,j), one rounding each.
using Weights = std::array<std::array<double, kTerms>, kTerms>;
const Weights& BernsteinWeights(int n) {
  static const std::array<Weights, kTerms> all = [] {
    std::array<Weights, kTerms> w{};
    for (int m = 0; m < kTerms; ++m)
      for (int i = 0; i <= m; ++i)
        for (int j = 0; j <= i; ++j)
          w[static_cast<size_t>(m)][static_cast<size_t>(i)][static_cast<size_t>(j)] =
              math::Binomial(i, j) / math::Binomial(m, j);
    return w;
  }();
  return all[static_cast<size_t>(n)];
}

/// A lower bound of the form on [from, to], from its Bernstein coefficients there.
///
/// Rounding: with absolute values in place of all terms, f(from + w s) has coefficients of sum at
/// most `size`, because from + w <= 1, and the weights of the Bernstein form are at most 1; so
/// every number on the way is at most size and every rounding costs at most u size. A coefficient
/// of the form takes at most 20 roundings, the shift by `from` 2 n + 1, the powers of w 2 n + 1,
/// the weights and their sum n + 3: below 105 for n <= 15. Numbers below 1e-300 may vanish.
double LowestOf(Form form, int n, double from, double to) {
  double* f = form.f;
  if (from > 0.0)
    for (int i = 0; i < n; ++i)
      for (int k = n - 1; k >= i; --k) f[k] += from * f[k + 1];
  const double w = to - from;
  double power = 1.0;
  for (int k = 1; k <= n; ++k) f[k] *= power *= w;
  const Weights& weights = BernsteinWeights(n);
  double lowest = f[0];
  for (int i = 1; i <= n; ++i) {
    double b = 0.0;
    for (int j = 0; j <= i; ++j)
      b += weights[static_cast<size_t>(i)][static_cast<size_t>(j)] * f[j];
    lowest = b < lowest ? b : lowest;
    if (!(b > kNothing)) return kNothing;
  }
  if (!(form.size < 1e300)) return kNothing;
  return lowest - 128.0 * kRounding * form.size - 1e-300;
}

int DegreeOf(const Ball& ball, const Body& body) {
  const Eigen::Index rows = std::max({ball.center.rows(), ball.radius.size(), body.center.rows(),
                                      Eigen::Index{body.sigmas == 0.0 ? 1 : 3}});
  return static_cast<int>(rows) - 1;
}

/// `form`: what the body takes. The lower bound for one ball.
double RoomOf(const Separation& s, const Ball& ball, const Body& body, double length, Form form) {
  const int n = DegreeOf(ball, body);
  if (n >= kTerms || !AddCurve(ball.center, s.normal, 1.0, &form)) return kNothing;
  for (int k = 0; k < ball.radius.size(); ++k)
    form.Add(k, -length * ball.radius[k], length * std::abs(ball.radius[k]));
  return LowestOf(form, n, s.from, s.to);
}

}  // namespace

bool IsWellFormed(const std::vector<Separation>& certificate, double from, double to) {
  if (certificate.empty() || !(certificate.front().from <= from)) return false;
  for (size_t i = 0; i < certificate.size(); ++i)
    if (!IsUsable(certificate[i]) || (i > 0 && !(certificate[i].from <= certificate[i - 1].to)))
      return false;
  return certificate.back().to >= to;
}

double ProvenRoom(const Separation& s, const Ball& drone, const Ball* target, const Body& body) {
  if (!IsUsable(s) || !(body.half.minCoeff() >= 0.0) || !(body.sigmas >= 0.0)) return kNothing;
  Form form;
  AddSolid(body, s.normal, &form);
  AddUncertainty(s, body, &form);
  if (!AddCurve(body.center, s.normal, -1.0, &form)) return kNothing;
  const double length = s.normal.norm();
  double room = RoomOf(s, drone, body, length, form);
  if (target) room = std::min(room, RoomOf(s, *target, body, length, form));
  return room / length - 8.0 * kRounding * std::abs(room);  // |n| and the quotient are rounded
}

bool IsCertificate(const std::vector<Separation>& certificate, double from, double to,
                   const Ball& drone, const Ball* target, const Body& body) {
  if (!IsWellFormed(certificate, from, to)) return false;
  for (const Separation& s : certificate)
    if (!(ProvenRoom(s, drone, target, body) >= 0.0)) return false;
  return true;
}

}  // namespace chase::world
