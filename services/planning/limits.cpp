#include "services/planning/limits.h"

#include <algorithm>
#include <cmath>

#include "common/math/bernstein.h"
#include "services/planning/candidate_set.h"
#include "services/planning/field_of_view.h"

namespace chase::planning {
namespace {

using math::Polynomial;
using math::Positivity;

constexpr double kRounding = 0x1p-53;
constexpr int kDepth = 24;

bool IsPositive(const Polynomial& b, double error) {
  return math::DecidePositive(b, error, kDepth) == Positivity::kPositive;
}

// ---- by control points ----

constexpr int kDegree = 6;
constexpr int kHalvings = 3;
// Relative to the largest sum of power coefficients of a coordinate: far above what rounding adds
// to points, to their differences (at most 4 n (n - 1) of them for an acceleration) and to halves.
constexpr double kSlack = 1e-11;

/// Control points at degree 6, and how far they may be off.
struct Net {
  double b[kDegree + 1][3];
  double error;
};

Net MakeNet(const Curve& curve) {
  const Points points = ToPoints(curve, kDegree);
  Net net{};
  double size = 0.0;
  for (int a = 0; a < 3; ++a) {
    size = std::max(size, curve.col(a).cwiseAbs().sum());
    for (int i = 0; i <= kDegree; ++i) net.b[i][a] = points(i, a);
  }
  net.error = kSlack * (1.0 + size);
  return net;
}

enum class Answer { kKept, kBroken, kOpen };

/// `order` 1 or 2: no control point of the derivative longer than `limit`; broken at an end.
Answer KeepsNorm(const Net& net, int order, double limit, double duration) {
  double d[kDegree][3];
  double scale = kDegree / duration;
  int n = kDegree;
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < 3; ++a) d[i][a] = net.b[i + 1][a] - net.b[i][a];
  if (order == 2) {
    scale *= (kDegree - 1) / duration;
    --n;
    for (int i = 0; i < n; ++i)
      for (int a = 0; a < 3; ++a) d[i][a] = d[i + 1][a] - d[i][a];
  }
  double longest2 = 0.0, ends2 = 0.0;
  for (int i = 0; i < n; ++i) {
    const double length2 = d[i][0] * d[i][0] + d[i][1] * d[i][1] + d[i][2] * d[i][2];
    longest2 = std::max(longest2, length2);
    if (i == 0 || i == n - 1) ends2 = std::max(ends2, length2);
  }
  const double most = limit / scale;
  if (longest2 < std::pow(std::max(0.0, most - net.error), 2)) return Answer::kKept;
  return ends2 > std::pow(most + net.error, 2) ? Answer::kBroken : Answer::kOpen;
}

Answer KeepsHeight(const Net& net, const Limits& l) {
  const Ground& g = l.ground;
  double z[kDegree + 1];
  for (int i = 0; i <= kDegree; ++i) z[i] = g.Above({net.b[i][0], net.b[i][1], net.b[i][2]});
  const auto [low, high] = std::minmax_element(z, z + kDegree + 1);
  const double error =
      net.error * (1.0 + std::abs(g.slope_x) + std::abs(g.slope_y)) + kSlack * std::abs(g.z0);
  if (*low - error > l.z_min && *high + error < l.z_max) return Answer::kKept;
  for (const double end : {z[0], z[kDegree]})
    if (end < l.z_min - error || end > l.z_max + error) return Answer::kBroken;
  return Answer::kOpen;
}

/// The plan seen from the target: farther than `distance`, lower than tangent `elevation` where
/// that is above 0. Beyond a vertical plane at h, all of the piece is at least h away.
bool KeepsAway(const Net& net, double elevation, double distance, int halvings) {
  double m[2] = {}, rise = 0.0;
  for (int i = 0; i <= kDegree; ++i) {
    for (int a = 0; a < 2; ++a) m[a] += net.b[i][a];
    rise = std::max(rise, std::abs(net.b[i][2]));
  }
  const double length = std::sqrt(m[0] * m[0] + m[1] * m[1]);
  double h = HUGE_VAL;
  for (int i = 0; i <= kDegree; ++i) h = std::min(h, m[0] * net.b[i][0] + m[1] * net.b[i][1]);
  h = h / std::max(length, 1e-300) * (1.0 - kSlack) - 2.0 * net.error;
  if (h > distance && (elevation <= 0.0 || elevation * h > rise + net.error)) return true;
  if (halvings == 0) return false;
  Net left = net, right = net;
  left.error = right.error = 1.01 * net.error;
  for (int k = 1; k <= kDegree; ++k) {
    for (int i = 0; i <= kDegree - k; ++i)
      for (int a = 0; a < 3; ++a) right.b[i][a] = 0.5 * (right.b[i][a] + right.b[i + 1][a]);
    for (int a = 0; a < 3; ++a) left.b[k][a] = right.b[0][a];
  }
  return KeepsAway(left, elevation, distance, halvings - 1) &&
         KeepsAway(right, elevation, distance, halvings - 1);
}

// ---- as signs of polynomials ----

/// Sum of weight_i x_i^2 over polynomials x_i of equal degree, plus a constant, in Bernstein form.
struct SquareSum {
  Polynomial b;
  double magnitude;  ///< bounds the sum of the absolute terms

  SquareSum(int degree, double constant)
      : b(Polynomial::Constant(2 * degree + 1, constant)), magnitude(std::abs(constant)) {}
  void Add(double weight, const Polynomial& power) {
    const Polynomial x = math::PowerToBernstein(power);
    b += weight * math::BernsteinProduct(x, x);
    const double sum = power.cwiseAbs().sum();
    magnitude += std::abs(weight) * sum * sum;
  }
  bool IsPositive() const { return planning::IsPositive(b, 128.0 * kRounding * magnitude); }
};

Polynomial DerivativeOf(const Curve& plan, int axis, int order, double duration) {
  Polynomial p = plan.col(axis);
  for (int i = 0; i < order; ++i) p = math::Derivative(p) / duration;
  return p;
}

bool KeepsNorm(const Curve& plan, int order, double limit, double duration) {
  if (plan.rows() <= order) return true;  // of a lower degree: the derivative is zero
  SquareSum sum(static_cast<int>(plan.rows()) - 1 - order, limit * limit);
  for (int a = 0; a < 3; ++a) sum.Add(-1.0, DerivativeOf(plan, a, order, duration));
  return sum.IsPositive();
}

bool KeepsHeight(const Curve& plan, const Limits& l) {
  const Ground& g = l.ground;
  Polynomial z = plan.col(2) - g.slope_x * plan.col(0) - g.slope_y * plan.col(1);
  z[0] -= g.z0;
  const double terms = plan.cwiseAbs().colwise().sum().dot(
      Eigen::RowVector3d(std::abs(g.slope_x), std::abs(g.slope_y), 1.0));
  const Polynomial b = math::PowerToBernstein(z);
  const double error =
      math::PowerToBernsteinError(z) +
      4.0 * kRounding * (terms + std::abs(g.z0) + std::abs(l.z_min) + std::abs(l.z_max));
  const Polynomial above = b.array() - l.z_min, below = l.z_max - b.array();
  return IsPositive(above, error) && IsPositive(below, error);
}

/// Signs of squared coordinates of target - plan: weights (wx, wy, wz), plus a constant.
bool KeepsRelative(const Curve& plan, const Curve& target, const Eigen::Vector3d& weights,
                   double constant) {
  const Eigen::Index n = std::max(plan.rows(), target.rows());
  SquareSum sum(static_cast<int>(n) - 1, constant);
  for (int a = 0; a < 3; ++a) {
    Polynomial r = Polynomial::Zero(n);
    r.head(plan.rows()) = plan.col(a);
    r.head(target.rows()) -= target.col(a);
    sum.Add(weights[a], r);
  }
  return sum.IsPositive();
}

bool KeepsNorm(const Net* net, const Curve& plan, int order, double limit, double duration) {
  const Answer answer = net ? KeepsNorm(*net, order, limit, duration) : Answer::kOpen;
  return answer == Answer::kKept ||
         (answer == Answer::kOpen && KeepsNorm(plan, order, limit, duration));
}

bool KeepsHeight(const Net* net, const Curve& plan, const Limits& l) {
  const Answer answer = net ? KeepsHeight(*net, l) : Answer::kOpen;
  return answer == Answer::kKept || (answer == Answer::kOpen && KeepsHeight(plan, l));
}

}  // namespace

bool KeepsLimits(const Curve& plan, const Problem& problem) {
  const Limits& l = problem.limits;
  const Curve& target = problem.target;
  const bool small = std::max(plan.rows(), target.rows()) <= kDegree + 1;
  Net net{};
  if (small) net = MakeNet(plan);
  const Net* quick = small ? &net : nullptr;
  if (l.height && !KeepsHeight(quick, plan, l)) return false;
  if (l.speed > 0.0 && !KeepsNorm(quick, plan, 1, l.speed, problem.duration)) return false;
  if (l.acceleration > 0.0 && !KeepsNorm(quick, plan, 2, l.acceleration, problem.duration))
    return false;
  if (l.view && !KeepsView(plan, target, problem.duration, nullptr, *l.view, l.view_from))
    return false;
  if (!(l.tan_elevation > 0.0) && !(l.min_distance > 0.0)) return true;
  if (small) {
    const Net seen = MakeNet(target);
    for (int i = 0; i <= kDegree; ++i)
      for (int a = 0; a < 3; ++a) net.b[i][a] -= seen.b[i][a];
    net.error += seen.error;
    if (KeepsAway(net, l.tan_elevation, l.min_distance, kHalvings)) return true;
  }
  const double t2 = l.tan_elevation * l.tan_elevation;
  if (t2 > 0.0 && !KeepsRelative(plan, target, {t2, t2, -1.0}, 0.0)) return false;
  return !(l.min_distance > 0.0) ||
         KeepsRelative(plan, target, Eigen::Vector3d::Ones(), -l.min_distance * l.min_distance);
}

}  // namespace chase::planning
