#include "test/bench/literal_planner.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "services/planning/cost.h"

namespace chase::planning {
namespace {

constexpr int kTerms = 7, kFormTerms = 2 * kTerms - 1;
constexpr double kTolerance = 1e-14;

/// Power coefficients of a curve in seconds, axis by axis.
struct Path {
  double c[3][kTerms] = {};
};

/// Centre p + v t and shape R of an obstacle.
struct Body {
  double p[3], v[3], R[3][3];
};

Path InSeconds(const Curve& curve, double T) {
  Path path;
  double scale = 1.0;
  for (int k = 0; k < curve.rows(); ++k, scale /= T)
    for (int a = 0; a < 3; ++a) path.c[a][k] = scale * curve(k, a);
  return path;
}

Body MakeBody(const Ellipsoid& e, double T) {
  Body body{};
  for (int a = 0; a < 3; ++a) {
    body.p[a] = e.center(0, a);
    if (e.center.rows() > 1) body.v[a] = e.center(1, a) / T;
    for (int b = 0; b < 3; ++b) body.R[a][b] = e.safety(a, b);
  }
  return body;
}

double Largest(const double* c, int degree) {
  double largest = 0.0;
  for (int i = 0; i <= degree; ++i) largest = std::max(largest, std::abs(c[i]));
  return largest;
}

class Chain {
 public:
  Chain(const double* p, int degree) {
    const double least = kTolerance * Largest(p, degree);
    while (degree > 0 && std::abs(p[degree]) <= least) --degree;
    std::copy(p, p + degree + 1, member_[0]);
    degree_[0] = degree;
    if (degree == 0) return;
    for (int i = 1; i <= degree; ++i) member_[1][i - 1] = i * p[i];
    degree_[1] = degree - 1;
    size_ = 2;
    while (degree_[size_ - 1] > 0 && Append()) ++size_;
  }

  int RootsUpTo(double t) const { return Changes(0.0) - Changes(t); }

 private:
  /// The negative remainder of the last two members; false where there is none.
  bool Append() {
    double* rest = member_[size_];
    const double *dividend = member_[size_ - 2], *divisor = member_[size_ - 1];
    const int n = degree_[size_ - 2], d = degree_[size_ - 1];
    std::copy(dividend, dividend + n + 1, rest);
    const double least = kTolerance * Largest(rest, n);
    for (int k = n; k >= d; --k) {
      const double q = rest[k] / divisor[d];
      for (int j = 0; j < d; ++j) rest[k - d + j] -= q * divisor[j];
    }
    int degree = d - 1;
    while (degree > 0 && std::abs(rest[degree]) <= least) --degree;
    const double scale = Largest(rest, degree);
    if (scale <= least) return false;
    for (int i = 0; i <= degree; ++i) rest[i] /= -scale;
    degree_[size_] = degree;
    return true;
  }

  int Changes(double t) const {
    int changes = 0;
    double last = 0.0;
    for (int i = 0; i < size_; ++i) {
      double value = 0.0;
      for (int k = degree_[i]; k >= 0; --k) value = value * t + member_[i][k];
      if (value == 0.0) continue;
      changes += value * last < 0.0;
      last = value > 0.0 ? 1.0 : -1.0;
    }
    return changes;
  }

  double member_[kFormTerms + 1][kFormTerms];
  int degree_[kFormTerms + 1];
  int size_ = 1;
};

Path Relative(const Path& path, const Body& body) {
  Path x = path;
  for (int a = 0; a < 3; ++a) x.c[a][0] -= body.p[a], x.c[a][1] -= body.v[a];
  return x;
}

/// Has x' R y, given Rx, stayed above 1 from 0 to T?
bool StaysAboveOne(const Path& Rx, const Path& y, int n, double T) {
  double f[kFormTerms] = {-1.0};
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) f[i + j] += Rx.c[a][i] * y.c[a][j];
  return f[0] > 0.0 && Chain(f, 2 * n - 2).RootsUpTo(T) == 0;
}

bool IsClear(const Path& plan, const Path& target, const Body& body, int n, double T) {
  const Path x = Relative(plan, body), y = Relative(target, body);
  Path Rx;
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < n; ++i)
      Rx.c[a][i] = body.R[a][0] * x.c[0][i] + body.R[a][1] * x.c[1][i] + body.R[a][2] * x.c[2][i];
  return StaysAboveOne(Rx, x, n, T) && StaysAboveOne(Rx, y, n, T);
}

/// Position and velocity at time t.
void At(const Path& path, int n, double t, double p[3], double v[3]) {
  for (int a = 0; a < 3; ++a) {
    p[a] = v[a] = 0.0;
    for (int k = n; k-- > 0;) v[a] = v[a] * t + p[a], p[a] = p[a] * t + path.c[a][k];
  }
}

double Smoothness(const PlannerConfig& config, const Path& plan, int n, double T) {
  double sum = 0.0;
  for (int i = 2; i < n; ++i)
    for (int j = 2; j < n; ++j) {
      const double ij =
          (plan.c[0][i] * plan.c[0][j] + plan.c[1][i] * plan.c[1][j]) + plan.c[2][i] * plan.c[2][j];
      const double second = i * (i - 1.0) * j * (j - 1.0), third = second * (i - 2.0) * (j - 2.0);
      sum += config.rho_acceleration * second * ij * std::pow(T, i + j - 3) / (i + j - 3);
      if (i > 2 && j > 2)
        sum += config.rho_jerk * third * ij * std::pow(T, i + j - 5) / (i + j - 5);
    }
  return sum;
}

double Weigh(const PlannerConfig& config, const Path& plan, const Path& target,
             const std::vector<Body>& bodies, int n, double T) {
  double j2 = 0.0, j3 = 0.0, j4 = 0.0;
  for (int k = 0; k < kNodes; ++k) {
    const double t = T * GaussNodes().tau[k], w = T * GaussNodes().weight[k];
    double p[3], v[3], q[3], u[3];
    At(plan, n, t, p, v);
    At(target, n, t, q, u);
    for (const Body& b : bodies) {
      const double x = p[0] - b.p[0] - b.v[0] * t, y = p[1] - b.p[1] - b.v[1] * t,
                   z = p[2] - b.p[2] - b.v[2] * t;
      const double s = x * (b.R[0][0] * x + b.R[0][1] * y + b.R[0][2] * z) +
                       y * (b.R[1][0] * x + b.R[1][1] * y + b.R[1][2] * z) +
                       z * (b.R[2][0] * x + b.R[2][1] * y + b.R[2][2] * z);
      j2 += w * ObstacleCost(config, std::sqrt(s));
    }
    const double x = q[0] - p[0], y = q[1] - p[1], z = q[2] - p[2], level = x * x + y * y;
    const double excess = std::sqrt(level + z * z) - config.desired_distance;
    const double turn = (x * (u[1] - v[1]) - y * (u[0] - v[0])) /
                        std::max(level, kYawDistanceFloor * kYawDistanceFloor);
    j3 += w * excess * excess, j4 += w * turn * turn;
  }
  return config.weight_smooth * Smoothness(config, plan, n, T) + config.weight_obstacle * j2 +
         config.weight_distance * j3 + config.weight_yaw * j4;
}

/// Coefficients of all candidates: three columns (x, y, z) each.
Eigen::MatrixXd SolveAll(const PlannerConfig& config, const Problem& problem) {
  const int n = problem.degree + 1, steps = static_cast<int>(problem.skeletons.size());
  const double T = problem.duration;
  const Path start = InSeconds(problem.start, T);
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(n + 4, n + 4), basis(n, steps);
  Eigen::MatrixXd Y = Eigen::MatrixXd::Zero(n + 4, 3 * problem.n_candidates());
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < steps; ++k) basis(i, k) = std::pow(T * (k + 1) / steps, i);
  for (int i = 2; i < n; ++i)
    for (int j = 2; j < n; ++j)
      K(i, j) = 2.0 * i * (i - 1) * j * (j - 1) * std::pow(T, i + j - 3) / (i + j - 3);
  K.topLeftCorner(n, n) += 2.0 * config.waypoint_weight * basis * basis.transpose();
  for (int k = 0; k < 4; ++k) {
    K(n + k, k) = K(k, n + k) = 1.0;
    for (int c = 0; c < Y.cols(); ++c) Y(n + k, c) = start.c[c % 3][k];
  }
  for (int c = 0; c < Y.cols(); ++c)
    for (int k = 0, rest = c / 3; k < steps; ++k) {
      const auto& choices = problem.skeletons[static_cast<size_t>(k)];
      const auto& u = choices[static_cast<size_t>(rest) % choices.size()];
      rest /= static_cast<int>(choices.size());
      for (int i = 0; i < n; ++i) Y(i, c) += 2.0 * config.waypoint_weight * basis(i, k) * u[c % 3];
    }
  return (K.fullPivLu().inverse() * Y).topRows(n);
}

}  // namespace

LiteralPlan PlanLiterally(const PlannerConfig& config, const Problem& problem) {
  const double T = problem.duration;
  const int n = problem.degree + 1;
  const Eigen::MatrixXd solved = SolveAll(config, problem);
  const Path target = InSeconds(problem.target, T);
  std::vector<Body> bodies;
  for (const Ellipsoid& e : problem.obstacles) bodies.push_back(MakeBody(e, T));
  LiteralPlan best;
  for (int c = 0; c < problem.n_candidates(); ++c) {
    Path plan;
    for (int a = 0; a < 3; ++a)
      for (int k = 0; k < n; ++k) plan.c[a][k] = solved(k, 3 * c + a);
    if (!std::all_of(bodies.begin(), bodies.end(),
                     [&](const Body& b) { return IsClear(plan, target, b, n, T); }))
      continue;
    ++best.feasible;
    const double cost = Weigh(config, plan, target, bodies, n, T);
    if (best.index >= 0 && !(cost < best.cost)) continue;
    best.index = c;
    best.cost = cost;
  }
  return best;
}

}  // namespace chase::planning
