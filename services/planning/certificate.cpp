#include "services/planning/certificate.h"

#include <algorithm>
#include <cmath>

#include "common/math/bernstein.h"
#include "common/math/exact.h"
#include "services/planning/field_of_view.h"
#include "services/planning/limits.h"
#include "services/planning/product_weights.h"
#include "services/planning/separations.h"
#include "services/planning/sturm_check.h"

namespace chase::planning {
namespace {

using math::ExactPolynomial;
using math::Polynomial;
using math::Positivity;

constexpr double kRounding = 0x1p-53;
constexpr int kDepth = 24;

/// A polynomial in Bernstein form and a bound on the error of its coefficients.
struct Bounded {
  Polynomial b;
  double error = 0.0;
};

/// Control points of curve - center in Bernstein form, and the sum X1 of the absolute power
/// coefficients of both, largest axis. Every coordinate is at most X1 in magnitude and off by at
/// most (n + 7) u X1: one rounding from the difference, n + 6 from the conversion
/// (PowerToBernsteinError).
struct Relative {
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 16> points;
  double magnitude = 0.0;
};

Relative MakeRelative(const Curve& curve, const Curve& center, int degree) {
  Relative r;
  r.points.resize(3, degree + 1);
  for (int axis = 0; axis < 3; ++axis) {
    Polynomial p = Polynomial::Zero(degree + 1);
    p.head(curve.rows()) = curve.col(axis);
    p.head(center.rows()) -= center.col(axis);
    r.points.row(axis) = math::PowerToBernstein(p).transpose();
    r.magnitude =
        std::max(r.magnitude, curve.col(axis).cwiseAbs().sum() + center.col(axis).cwiseAbs().sum());
  }
  return r;
}

/// x' R y - 1 in Bernstein form. Terms w_ij x_i' R y_j with weights that sum to 1 over i + j = k
/// are at most X1 Y1 sum|R_ab| in sum. Evaluating one takes at most 7 + n roundings plus 4 for the
/// weight, and the coordinates bring in 2 (n + 8): for n <= 12 less than 64 u in all, and u more
/// for the final difference.
Bounded Form(const Relative& x, const Eigen::Matrix3d& R, const Relative& y) {
  const int n = static_cast<int>(x.points.cols()) - 1;
  Bounded f{Polynomial::Constant(2 * n + 1, -1.0), 0.0};
  const bool tabled = n == 5 || n == 6;
  for (int i = 0; i <= n; ++i) {
    const Eigen::Vector3d Rx = R * x.points.col(i);
    for (int j = 0; j <= n; ++j) {
      const double weight =
          tabled ? ProductWeights(n).value[i][j]
                 : math::Binomial(n, i) * math::Binomial(n, j) / math::Binomial(2 * n, i + j);
      f.b[i + j] += weight * Rx.dot(y.points.col(j));
    }
  }
  f.error = 64.0 * kRounding * (1.0 + x.magnitude * y.magnitude * R.cwiseAbs().sum());
  return f;
}

/// The part on [from, 1]; one more split, one more set of roundings.
Bounded From(Bounded f, double from) {
  if (from <= 0.0) return f;
  Polynomial left, right;
  math::SplitBernstein(f.b, from, &left, &right);
  const double n = static_cast<double>(f.b.size());
  return {right, f.error + 4.0 * n * kRounding * f.b.cwiseAbs().maxCoeff()};
}

/// Positivity of P, Q and (S > 0 or P Q > S^2) by joint subdivision. On a piece with
/// lower bounds p, q, s of P, Q, S: fine if s > 0, or if p, q > 0 and p q > s^2. Broken where an
/// end shows S < 0 and P Q < S^2.
Positivity DecideSight(const Bounded& P, const Bounded& Q, const Bounded& S, int depth) {
  const double p = P.b.minCoeff() - P.error, q = Q.b.minCoeff() - Q.error,
               s = S.b.minCoeff() - S.error;
  if (p > 0.0 && q > 0.0 && (s > 0.0 || p * q * (1.0 - 1e-14) > s * s))
    return Positivity::kPositive;
  const Eigen::Index last = P.b.size() - 1;
  bool open_end = false;
  for (Eigen::Index e : {Eigen::Index{0}, last}) {
    const double s_high = S.b[e] + S.error;
    const double p_high = std::max(0.0, P.b[e] + P.error), q_high = std::max(0.0, Q.b[e] + Q.error);
    if (P.b[e] < -P.error || Q.b[e] < -Q.error) return Positivity::kNotPositive;
    if (s_high < 0.0 && p_high * q_high * (1.0 + 1e-14) < s_high * s_high)
      return Positivity::kNotPositive;
    const double s_low = S.b[e] - S.error, p_low = P.b[e] - P.error, q_low = Q.b[e] - Q.error;
    const bool clear = p_low > 0.0 && q_low > 0.0 &&
                       (s_low > 0.0 || p_low * q_low * (1.0 - 1e-14) > s_low * s_low);
    open_end = open_end || !clear;
  }
  if (depth == 0 || open_end) return Positivity::kUndecided;
  Bounded halves[2][3];
  const Bounded* whole[3] = {&P, &Q, &S};
  for (int k = 0; k < 3; ++k) {
    math::SplitBernstein(whole[k]->b, 0.5, &halves[0][k].b, &halves[1][k].b);
    const double step =
        1.01 * static_cast<double>(last) * kRounding * whole[k]->b.cwiseAbs().maxCoeff();
    halves[0][k].error = halves[1][k].error = whole[k]->error + step;
  }
  const Positivity first = DecideSight(halves[0][0], halves[0][1], halves[0][2], depth - 1);
  if (first == Positivity::kNotPositive) return first;
  const Positivity second = DecideSight(halves[1][0], halves[1][1], halves[1][2], depth - 1);
  return second == Positivity::kPositive ? first : second;
}

Positivity Decide(const Bounded& f) { return math::DecidePositive(f.b, f.error, kDepth); }

Positivity Both(Positivity a, Positivity b) {
  if (a == Positivity::kNotPositive || b == Positivity::kNotPositive)
    return Positivity::kNotPositive;
  return a == Positivity::kPositive ? b : a;
}

// ---- exact ----

struct ExactRelative {
  ExactPolynomial axis[3];
};

ExactRelative MakeExactRelative(const Curve& curve, const Curve& center) {
  ExactRelative r;
  for (int a = 0; a < 3; ++a)
    r.axis[a] =
        math::MakeExact(Polynomial(curve.col(a))) - math::MakeExact(Polynomial(center.col(a)));
  return r;
}

/// p(from + (1 - from) t).
ExactPolynomial ExactFrom(const ExactPolynomial& p, double from) {
  if (from <= 0.0) return p;
  const ExactPolynomial map = math::MakeExact(Polynomial(Eigen::Vector2d(from, 1.0 - from)));
  ExactPolynomial r;
  for (size_t k = p.c.size(); k-- > 0;) {
    ExactPolynomial c;
    c.c = {p.c[k]};
    c.exponent = p.exponent;
    r = r * map + c;
  }
  return r;
}

ExactPolynomial ExactForm(const ExactRelative& x, const Eigen::Matrix3d& R, const ExactRelative& y,
                          double from) {
  ExactPolynomial f = math::MakeExact(-1.0);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) f = f + math::MakeExact(R(a, b)) * x.axis[a] * y.axis[b];
  return ExactFrom(f, from);
}

bool IsSafeExact(const Curve& plan, const Ellipsoid& e) {
  const ExactRelative x = MakeExactRelative(plan, e.center);
  return math::IsPositiveExact(ExactForm(x, e.safety, x, e.safety_from));
}

bool IsInSightExact(const Curve& plan, const Curve& target, const Ellipsoid& e, double from,
                    bool exact) {
  const ExactRelative x = MakeExactRelative(plan, e.center);
  const ExactRelative y = MakeExactRelative(target, e.center);
  const ExactPolynomial P = ExactForm(x, e.sight, x, from), Q = ExactForm(y, e.sight, y, from),
                        S = ExactForm(x, e.sight, y, from);
  if (exact) return math::IsSightClearExact(P, Q, S);
  return math::IsPositiveExact(P) && math::IsPositiveExact(Q) && math::IsPositiveExact(S);
}

}  // namespace

bool IsSafe(const Curve& plan, const Ellipsoid& e, Arithmetic arithmetic) {
  if (arithmetic == Arithmetic::kDoubleSturm)
    return SturmCheck(plan, e, 1.0, plan.rows()).IsSafe(plan);
  if (arithmetic == Arithmetic::kExactSturm) return IsSafeExact(plan, e);
  const int n = static_cast<int>(std::max(plan.rows(), e.center.rows())) - 1;
  const Relative x = MakeRelative(plan, e.center, n);
  const Positivity decided = Decide(From(Form(x, e.safety, x), e.safety_from));
  if (decided != Positivity::kUndecided) return decided == Positivity::kPositive;
  return IsSafeExact(plan, e);
}

bool IsInSight(const Curve& plan, const Curve& target, const Ellipsoid& e, double from, bool exact,
               Arithmetic arithmetic) {
  from = std::max(from, e.sight_from);
  if (from >= 1.0) return true;
  if (arithmetic == Arithmetic::kDoubleSturm)
    return SturmCheck(target, e, from, plan.rows()).IsInSight(plan);
  if (arithmetic == Arithmetic::kExactSturm) return IsInSightExact(plan, target, e, from, exact);
  const int n = static_cast<int>(std::max({plan.rows(), target.rows(), e.center.rows()})) - 1;
  const Relative x = MakeRelative(plan, e.center, n), y = MakeRelative(target, e.center, n);
  const Bounded P = From(Form(x, e.sight, x), from), Q = From(Form(y, e.sight, y), from),
                S = From(Form(x, e.sight, y), from);
  const Positivity decided =
      exact ? DecideSight(P, Q, S, kDepth) : Both(Decide(P), Both(Decide(Q), Decide(S)));
  if (decided != Positivity::kUndecided) return decided == Positivity::kPositive;
  return IsInSightExact(plan, target, e, from, exact);
}

bool IsFeasible(const Curve& plan, const Problem& problem, double sight_from, bool exact,
                Arithmetic arithmetic) {
  if (!plan.allFinite() || !KeepsLimits(plan, problem)) return false;
  for (const Ellipsoid& e : problem.obstacles)
    if (!IsSafe(plan, e, arithmetic) ||
        !IsInSight(plan, problem.target, e, sight_from, exact, arithmetic))
      return false;
  return StaysOff(plan, problem, sight_from);
}

std::string SampleFaults(const Curve& plan, const Problem& problem, double sight_from, int n) {
  for (int i = 0; i <= n; ++i) {
    const double tau = static_cast<double>(i) / n;
    const Eigen::Vector3d p = Evaluate(plan, tau), q = Evaluate(problem.target, tau);
    for (const Ellipsoid& e : problem.obstacles) {
      const Eigen::Vector3d c = Evaluate(e.center, tau);
      const std::string where = "obstacle " + std::to_string(e.id) + " at " + std::to_string(tau);
      if (tau >= e.safety_from && (p - c).dot(e.safety * (p - c)) < 1.0 - 1e-9)
        return "inside " + where;
      if (tau >= std::max(sight_from, e.sight_from) && e.sight_from < kNoSight &&
          sight_from < kNoSight && world::SegmentSquaredDistance(p, q, c, e.sight) < 1.0 - 1e-9)
        return "sight crosses " + where;
    }
    const Limits& l = problem.limits;
    const double speed = Evaluate(plan, tau, 1).norm() / problem.duration;
    if (l.speed > 0.0 && speed > l.speed * (1 + 1e-9)) return "too fast";
    const double acceleration =
        Evaluate(plan, tau, 2).norm() / (problem.duration * problem.duration);
    if (l.acceleration > 0.0 && acceleration > l.acceleration * (1 + 1e-9)) return "too steep";
    const double z = l.ground.Above(p);
    if (l.height && (z < l.z_min - 1e-9 || z > l.z_max + 1e-9)) return "height";
    if (l.min_distance > 0.0 && (p - q).norm() < l.min_distance - 1e-9) return "too near";
    if (l.tan_elevation > 0.0 &&
        std::abs(p.z() - q.z()) > l.tan_elevation * (p - q).head<2>().norm() + 1e-9)
      return "elevation";
    if (l.view && tau >= l.view_from) {
      const double T = problem.duration;
      const double below = SeenBelow(q - p, Evaluate(plan, tau, 1) / T,
                                     Evaluate(plan, tau, 2) / (T * T), l.view->drag);
      if (!(below < l.view->down + 1e-9) || !(below > -l.view->up - 1e-9)) return "image";
    }
  }
  return "";
}

}  // namespace chase::planning
