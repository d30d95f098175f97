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
  Points b;
  double error;
};

Net MakeNet(const Curve& curve) {
  return {ToPoints(curve, kDegree), kSlack * (1.0 + curve.cwiseAbs().sum())};
}

/// The heights above a ground are those of points along this.
Eigen::Vector3d UpNormal(const Ground& g) { return {-g.slope_x, -g.slope_y, 1.0}; }

enum class Answer { kKept, kBroken, kOpen };

/// By the least room that control points have, and those at the ends, which the curve goes through.
Answer Judge(double least, double at_ends, double error) {
  if (least > error) return Answer::kKept;
  return at_ends < -error ? Answer::kBroken : Answer::kOpen;
}

/// `order` 1 or 2: the derivative is no longer than `limit`.
Answer KeepsNorm(const Net& net, int order, double limit, double duration) {
  Points d = net.b;
  double scale = 1.0;
  const int n = kDegree - order;  // the last point of the derivative
  for (int k = kDegree; k > n; --k) {
    for (int i = 0; i < k; ++i) d.row(i) = d.row(i + 1) - d.row(i);
    scale *= k / duration;
  }
  const double most = limit / scale;
  const double longest = std::sqrt(d.topRows(n + 1).rowwise().squaredNorm().maxCoeff());
  const double at_ends = std::max(d.row(0).norm(), d.row(n).norm());
  return Judge(most - longest, most - at_ends, net.error);
}

Answer KeepsHeight(const Net& net, const Limits& l) {
  const Eigen::Vector3d up = UpNormal(l.ground);
  const Eigen::Array<double, kDegree + 1, 1> z = (net.b * up).array() - l.ground.z0;
  const Eigen::Array<double, kDegree + 1, 1> room = (z - l.z_min).min(l.z_max - z);
  return Judge(room.minCoeff(), std::min(room[0], room[kDegree]), net.error * up.lpNorm<1>());
}

/// The plan seen from the target: farther than `distance`, lower than tangent `elevation` where
/// that is above 0. Beyond a vertical plane at h, all of the piece is at least h away.
bool KeepsAway(const Net& net, double elevation, double distance, int halvings) {
  const Eigen::Vector2d m = net.b.leftCols<2>().colwise().sum().transpose().normalized();
  const double rise = net.b.col(2).cwiseAbs().maxCoeff() + net.error;
  const double h = (net.b.leftCols<2>() * m).minCoeff() - 2.0 * net.error;
  if (h > distance && (elevation <= 0.0 || elevation * h > rise)) return true;
  if (halvings == 0) return false;
  Net left = net, right = net;
  right.b = Halve(&left.b);
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
  Polynomial z = plan * UpNormal(g);
  z[0] -= g.z0;
  const double terms = (plan * UpNormal(g).asDiagonal()).lpNorm<1>();
  const Polynomial b = math::PowerToBernstein(z);
  const double error = math::PowerToBernsteinError(z) +
                       4.0 * kRounding * Eigen::Vector4d(terms, g.z0, l.z_min, l.z_max).lpNorm<1>();
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

bool KeepsWithin(const Net* net, const Curve& plan, const Limits& l) {
  if (net &&
      (net->b.leftCols<2>().rowwise() - l.listed_about.transpose()).rowwise().norm().maxCoeff() +
              2.0 * net->error <
          l.listed_within)
    return true;
  SquareSum sum(static_cast<int>(plan.rows()) - 1, l.listed_within * l.listed_within);
  for (int a = 0; a < 2; ++a) {
    Polynomial r = plan.col(a);
    r[0] -= l.listed_about[a];
    sum.Add(-1.0, r);
  }
  return sum.IsPositive();
}

// Distance and elevation.
bool KeepsFromTarget(const Net* net, const Curve& plan, const Problem& problem) {
  const Limits& l = problem.limits;
  const Curve& target = problem.target;
  if (!(l.tan_elevation > 0.0) && !(l.min_distance > 0.0)) return true;
  if (net) {
    Net relative = *net;
    const Net seen = MakeNet(target);
    relative.b -= seen.b;
    relative.error += seen.error;
    if (KeepsAway(relative, l.tan_elevation, l.min_distance, kHalvings)) return true;
  }
  const double t2 = l.tan_elevation * l.tan_elevation;
  if (t2 > 0.0 && !KeepsRelative(plan, target, {t2, t2, -1.0}, 0.0)) return false;
  return !(l.min_distance > 0.0) ||
         KeepsRelative(plan, target, Eigen::Vector3d::Ones(), -l.min_distance * l.min_distance);
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
  if (std::isfinite(l.listed_within) && !KeepsWithin(quick, plan, l)) return false;
  return KeepsFromTarget(quick, plan, problem) &&
         (!l.view || KeepsView(plan, target, problem.duration, nullptr, *l.view, l.view_from));
}

}  // namespace chase::planning
