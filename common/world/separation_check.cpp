#include "common/world/separation_check.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace chase::world {
namespace {

using Eigen::Vector3d;

constexpr double kNothing = -HUGE_VAL;
constexpr double kRounding = 0x1p-53;
constexpr int kTerms = Sweep::kTerms;

/// A polynomial in the power basis whose coefficients are within 20 kRounding * size of the true
/// ones, where size bounds the sum of the absolute values of all that is added up.
struct Form {
  int terms = 1;
  double f[kTerms] = {};
  double size = 0.0;

  void Add(int k, double value, double magnitude) {
    f[k] += value;
    size += magnitude;
    terms = std::max(terms, k + 1);
  }
};

bool IsInterval(double from, double to) { return from >= 0.0 && from < to && to <= 1.0; }
bool IsNormal(const Vector3d& n) {
  const double squared = n.squaredNorm();
  return squared >= 0.5 && squared <= 2.0;
}
bool IsUsable(const Separation& s) { return IsInterval(s.from, s.to) && IsNormal(s.normal); }

/// n' M n and a bound of the sum of the absolute values of its terms, for a squared normal of 2 at
/// most.
double Quadratic(const Eigen::Matrix3d& M, const Vector3d& n, double* magnitude) {
  *magnitude = 2.0 * M.cwiseAbs().sum();
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

/// Adds minus an upper bound of sigmas sqrt(n' S n): sqrt(x) <= (x / m + m) / 2 for every m, tight
/// at `tau`, where m = sqrt(x).
void AddUncertainty(const Vector3d& n, double tau, const Body& body, Form* form) {
  if (body.sigmas == 0.0) return;
  double squared[3], magnitude[3];
  for (int k = 0; k < 3; ++k) squared[k] = Quadratic(body.covariance[k], n, &magnitude[k]);
  const double variance = (squared[2] * tau + squared[1]) * tau + squared[0];
  const double m = std::max(kLeastDeviation, std::sqrt(std::max(0.0, variance)));
  const double half = 0.5 * body.sigmas, over = half / m;
  for (int k = 0; k < 3; ++k) form->Add(k, -over * squared[k], over * magnitude[k]);
  form->Add(0, -half * m, half * m);
}

/// Adds minus n' curve; false where the degree is too high.
bool AddCurve(const Curve& curve, const Vector3d& n, Form* form) {
  if (curve.rows() > kTerms) return false;
  const Vector3d absolute = n.cwiseAbs();
  for (int k = 0; k < curve.rows(); ++k)
    form->Add(k, -(n.x() * curve(k, 0) + n.y() * curve(k, 1) + n.z() * curve(k, 2)),
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

/// Power coefficients f over [0,1] to Bernstein coefficients of degree n >= terms - 1 over
/// [from, to]; f is used up.
void ToBernstein(double* f, int terms, int n, double from, double to, double* b) {
  if (from > 0.0)
    for (int i = 0; i + 1 < terms; ++i)
      for (int k = terms - 2; k >= i; --k) f[k] += from * f[k + 1];
  const double w = to - from;
  double power = 1.0;
  for (int k = 1; k < terms; ++k) f[k] *= power *= w;
  const Weights& weights = BernsteinWeights(n);
  for (int i = 0; i <= n; ++i) {
    const auto& row = weights[static_cast<size_t>(i)];
    b[i] = f[0];
    for (int j = 1; j <= std::min(i, terms - 1); ++j) b[i] += row[static_cast<size_t>(j)] * f[j];
  }
}

/// A lower bound of n' p - |n| r plus the form over the sweep's interval; `b`: the form's Bernstein
/// coefficients there.
///
/// Rounding: with absolute values in place of all terms, f(from + w s) has coefficients of sum at
/// most `size`, because from + w <= 1, and the weights of the Bernstein form are at most 1; so
/// every number on the way is at most size and every rounding costs at most u size. The shift by
/// `from` takes 2 n + 1 roundings, the powers of w 2 n + 1, the weights and their sum n + 3; before
/// that a coefficient of the form takes at most 20, after it a product and four sums are left:
/// below 105 for n <= 15. Numbers below 1e-300 may vanish.
double RoomOf(const Vector3d& n, double length, const Sweep& sweep, double size_of_form,
              const double* b) {
  double lowest = HUGE_VAL;
  for (int i = 0; i <= sweep.degree; ++i) {
    const double at = n.x() * sweep.points[0][i] + n.y() * sweep.points[1][i] +
                      n.z() * sweep.points[2][i] - length * sweep.points[3][i] + b[i];
    lowest = at < lowest ? at : lowest;
  }
  const double size = size_of_form + std::abs(n.x()) * sweep.size[0] +
                      std::abs(n.y()) * sweep.size[1] + std::abs(n.z()) * sweep.size[2] +
                      length * sweep.size[3];
  return size < 1e300 ? lowest - 128.0 * kRounding * size - 1e-300 : kNothing;
}

int DegreeOf(const Ball& ball) {
  return static_cast<int>(std::max(ball.center.rows(), ball.radius.size())) - 1;
}

}  // namespace

bool IsWellFormed(const Certificate& certificate, double from, double to) {
  if (certificate.empty() || !(certificate.front().from <= from)) return false;
  for (size_t i = 0; i < certificate.size(); ++i)
    if (!IsUsable(certificate[i]) || (i > 0 && !(certificate[i].from <= certificate[i - 1].to)))
      return false;
  return certificate.back().to >= to;
}

Sweep::Sweep(const Ball& ball, double from_, double to_, int least)
    : from(from_), to(to_), degree(std::max(DegreeOf(ball), least)) {
  if (degree >= kTerms || !IsInterval(from, to)) degree = -1;
  if (degree < 0) return;
  const int terms = static_cast<int>(ball.center.rows());
  for (int a = 0; a < 3; ++a) {
    double f[kTerms];
    size[a] = 0.0;
    for (int k = 0; k < terms; ++k) size[a] += std::abs(f[k] = ball.center(k, a));
    ToBernstein(f, terms, degree, from, to, points[a]);
  }
  SetRadius(ball.radius);
}

void Sweep::SetRadius(const math::Polynomial& radius) {
  const int terms = static_cast<int>(radius.size());
  if (terms > degree + 1) degree = -1;
  if (degree < 0) return;
  double f[kTerms] = {};
  size[3] = 0.0;
  for (int k = 0; k < terms; ++k) size[3] += std::abs(f[k] = radius[k]);
  ToBernstein(f, terms, degree, from, to, points[3]);
}

int DegreeOf(const Ball& ball, const Body& body) {
  const int asked = body.sigmas == 0.0 ? 0 : 2;
  return std::max({DegreeOf(ball), static_cast<int>(body.center.rows()) - 1, asked});
}

const Sweep& SweptBall::Over(double from, double to, const Body& body) {
  const int degree = DegreeOf(*ball_, body);
  if (!sweep_ || sweep_->degree != degree || sweep_->from != from || sweep_->to != to)
    sweep_.emplace(*ball_, from, to, degree);
  return *sweep_;
}

Rooms ProvenRooms(const Vector3d& n, const Sweep& drone, const Sweep* target, const Body& body) {
  constexpr Rooms kNone{kNothing, kNothing};
  if (!IsNormal(n) || !(body.half.minCoeff() >= 0.0) || !(body.sigmas >= 0.0)) return kNone;
  if (target && (target->from != drone.from || target->to != drone.to)) return kNone;
  Form form;
  AddSolid(body, n, &form);
  AddUncertainty(n, 0.5 * (drone.from + drone.to), body, &form);
  if (!AddCurve(body.center, n, &form)) return kNone;
  const double length = n.norm();
  double b[kTerms];
  int degree = -1;  // of b
  const auto room_of = [&](const Sweep& sweep) {
    if (sweep.degree + 1 < form.terms) return kNothing;
    if (sweep.degree != degree) {
      degree = sweep.degree;
      double f[kTerms];
      std::copy(form.f, form.f + form.terms, f);
      ToBernstein(f, form.terms, degree, sweep.from, sweep.to, b);
    }
    const double room = RoomOf(n, length, sweep, form.size, b);
    return room / length - 8.0 * kRounding * std::abs(room);  // |n| and the quotient are rounded
  };
  return {room_of(drone), target ? room_of(*target) : HUGE_VAL};
}

bool IsCertificate(const Certificate& certificate, double from, double to, SweptBall* drone,
                   SweptBall* target, const Body& body) {
  if (!IsWellFormed(certificate, from, to)) return false;
  for (const Separation& s : certificate) {
    const Sweep* second = target ? &target->Over(s.from, s.to, body) : nullptr;
    const Rooms rooms = ProvenRooms(s.normal, drone->Over(s.from, s.to, body), second, body);
    if (!(rooms.Least() >= 0.0)) return false;
  }
  return true;
}

}  // namespace chase::world
