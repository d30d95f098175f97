#include "services/planning/candidate_set.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/math/bernstein.h"

namespace chase::planning {
namespace {

double Bernstein(int n, int i, double x) {
  if (i < 0 || i > n) return 0.0;
  double value = math::Binomial(n, i);
  for (int k = 0; k < i; ++k) value *= x;
  for (int k = i; k < n; ++k) value *= 1.0 - x;
  return value;
}

// Gram matrix of the derivatives of the given order: integral over [0,T] of squares = b' G b.
Eigen::MatrixXd Gram(int degree, int order, double T) {
  Eigen::MatrixXd difference = Eigen::MatrixXd::Identity(degree + 1, degree + 1);
  for (int k = 0; k < order; ++k) {
    const Eigen::Index rows = difference.rows() - 1;
    difference =
        ((difference.bottomRows(rows) - difference.topRows(rows)) * ((degree - k) / T)).eval();
  }
  const int n = degree - order;
  Eigen::MatrixXd products(n + 1, n + 1);
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j)
      products(i, j) = T * math::Binomial(n, i) * math::Binomial(n, j) /
                       math::Binomial(2 * n, i + j) / (2 * n + 1);
  return difference.transpose() * products * difference;
}

}  // namespace

CandidateTables::CandidateTables(const PlannerConfig& config, int degree_, int steps_,
                                 double duration_)
    : degree(degree_), steps(steps_), duration(duration_) {
  const int n = degree + 1, free = degree - 3;
  const Eigen::MatrixXd acceleration = Gram(degree, 2, duration);
  Eigen::MatrixXd basis(steps, n);
  for (int k = 1; k <= steps; ++k)
    for (int i = 0; i < n; ++i)
      basis(k - 1, i) = Bernstein(degree, i, static_cast<double>(k) / steps);
  const double w = config.waypoint_weight;
  const Eigen::MatrixXd normal = acceleration + w * basis.transpose() * basis;
  const Eigen::LLT<Eigen::MatrixXd> llt(normal.bottomRightCorner(free, free));
  fixed = -llt.solve(normal.bottomLeftCorner(free, 4));
  pull = llt.solve(w * basis.rightCols(free).transpose());
  smooth.setZero();
  smooth.topLeftCorner(n, n) = config.weight_smooth * (config.rho_acceleration * acceleration +
                                                       config.rho_jerk * Gram(degree, 3, duration));
  Eigen::MatrixXd H = smooth.block(4, 4, free, free);
  H.diagonal().array() += 1e-12;
  const Eigen::LLT<Eigen::MatrixXd> factor(H);
  root.setZero();
  best.setZero();
  root.topLeftCorner(free, free) = Eigen::MatrixXd(factor.matrixU());
  best.topRows(free) = -factor.solve(Eigen::MatrixXd(smooth.block(4, 0, free, 4)));
  rest =
      smooth.topLeftCorner<4, 4>() + smooth.block(4, 0, free, 4).transpose() * best.topRows(free);
  std::fill(&phi_of[0][0], &phi_of[0][0] + 7 * kPadded, 0.0);
  std::fill(&slope_of[0][0], &slope_of[0][0] + 7 * kPadded, 0.0);
  for (int k = 0; k < kNodes; ++k)
    for (int i = 0; i < n; ++i) {
      const double x = GaussNodes().tau[k];
      phi[k][i] = Bernstein(degree, i, x);
      slope[k][i] =
          degree / duration * (Bernstein(degree - 1, i - 1, x) - Bernstein(degree - 1, i, x));
      phi_of[i][k] = phi[k][i];
      slope_of[i][k] = slope[k][i];
    }
  for (int k = 0; k < kPadded; ++k)
    for (int i = 0; i < 7; ++i) sample_of[i][k] = i < n ? Bernstein(degree, i, SampleAt(k)) : 0.0;
}

const CandidateTables& TableShelf::Get(int degree, int steps, double duration) {
  constexpr size_t kKept = 8;
  for (const CandidateTables& t : tables_)
    if (t.degree == degree && t.steps == steps && t.duration == duration) return t;
  if (tables_.size() < kKept) {
    tables_.reserve(kKept);
    tables_.emplace_back(config_, degree, steps, duration);
    return tables_.back();
  }
  next_ = (next_ + 1) % kKept;
  return tables_[next_] = CandidateTables(config_, degree, steps, duration);
}

namespace {

void Extend(const Points& points, int n, Box* box) {
  for (int i = 0; i < n; ++i) {
    box->low = box->low.min(points.row(i).transpose().array());
    box->high = box->high.max(points.row(i).transpose().array());
  }
}

}  // namespace

Box BoxOf(const Points& points, int n, double beyond) {
  Box box{Eigen::Array3d::Constant(HUGE_VAL), Eigen::Array3d::Constant(-HUGE_VAL)};
  Extend(points, n, &box);
  box.low -= beyond;
  box.high += beyond;
  return box;
}

bool Contains(const Box& box, const Curve& curve) {
  if (curve.rows() > 7) return false;
  const Points points = ToPoints(curve, 6);
  for (int i = 0; i < 7; ++i)
    for (int a = 0; a < 3; ++a)
      if (!(points(i, a) >= box.low[a] && points(i, a) <= box.high[a])) return false;
  return true;
}

bool MayTouch(const Box& box, const Curve& center, const Eigen::Array3d& half, double by) {
  for (int a = 0; a < 3; ++a) {
    double low = center(0, a), high = low;
    for (Eigen::Index k = 1; k < center.rows(); ++k) {  // tau^k is in [0,1]
      low += std::min(center(k, a), 0.0);
      high += std::max(center(k, a), 0.0);
    }
    if (std::max(low - box.high[a], box.low[a] - high) > by * half[a]) return false;
  }
  return true;
}

void LimitToReach(const PlannerConfig& config, const CandidateTables& t, double beyond,
                  Problem* problem) {
  problem->reach.reset();
  const int M = t.degree;
  if (!config.exact_visibility || problem->target.rows() > M + 1) return;
  const Points start = ToPoints(problem->start, M);
  Box box = BoxOf(ToPoints(problem->target, M), M + 1, 0.0);
  Extend(start, 4, &box);
  Eigen::Array3d low[3], high[3];
  for (int f = 0; f < M - 3; ++f)
    low[f] = high[f] = (t.fixed.row(f) * start.topRows<4>()).transpose().array();
  for (size_t n = 0; n < problem->skeletons.size(); ++n) {
    Eigen::Array3d least = Eigen::Array3d::Constant(HUGE_VAL), most = -least;
    for (const Eigen::Vector3d& u : problem->skeletons[n]) {
      least = least.min(u.array());
      most = most.max(u.array());
    }
    for (int f = 0; f < M - 3; ++f) {
      const double pull = t.pull(f, static_cast<Eigen::Index>(n));
      low[f] += pull * (pull > 0.0 ? least : most);
      high[f] += pull * (pull > 0.0 ? most : least);
    }
  }
  for (int f = 0; f < M - 3; ++f) {
    box.low = box.low.min(low[f] - beyond);
    box.high = box.high.max(high[f] + beyond);
  }
  const double size = std::max(box.low.abs().maxCoeff(), box.high.abs().maxCoeff());
  if (!(size < 1e6)) return;
  box.low -= 1e-6 + 1e-9 * size;
  box.high += 1e-6 + 1e-9 * size;
  problem->reach = box;
  problem->near.clear();
  for (size_t j = 0; j < problem->obstacles.size(); ++j) {
    const Ellipsoid& e = problem->obstacles[j];
    if (MayTouch(box, e.center,
                 (std::max(1.0, config.cost_range) * e.safety_half).max(e.sight_half), 1.0))
      problem->near.push_back(static_cast<int>(j));
  }
}

namespace {

/// value[j][k] = C(j,k) / C(n,k): share of power coefficient k in control point j.
template <int n>
struct Elevation {
  double value[n + 1][n + 1];
  constexpr Elevation() : value() {
    for (int j = 0; j <= n; ++j) {
      double weight = 1.0;
      for (int k = 0; k <= j; ++k) {
        value[j][k] = weight;
        if (k < j) weight *= static_cast<double>(j - k) / (n - k);
      }
    }
  }
};

template <int n>
void Elevate(const Curve& power, Points* out) {
  constexpr Elevation<n> kShare;
  for (int a = 0; a < 3; ++a) {
    double c[n + 1] = {}, b[n + 1] = {};
    for (Eigen::Index k = 0; k < std::min<Eigen::Index>(n + 1, power.rows()); ++k)
      c[k] = power(k, a);
#pragma GCC unroll 7
    for (int k = 0; k <= n; ++k)
#pragma GCC unroll 7
      for (int j = k; j <= n; ++j) b[j] += kShare.value[j][k] * c[k];
    for (int j = 0; j <= n; ++j) (*out)(j, a) = b[j];
    for (int j = n + 1; j < 7; ++j) (*out)(j, a) = 0.0;
  }
}

}  // namespace

Points ToPoints(const Curve& power, int degree) {
  Points b;
  degree == 5 ? Elevate<5>(power, &b) : Elevate<6>(power, &b);
  return b;
}

Points Halve(Points* points) {
  Points right = *points;
  for (int k = 1; k < 7; ++k) {
    for (int i = 0; i + k < 7; ++i) right.row(i) = 0.5 * (right.row(i) + right.row(i + 1));
    points->row(k) = right.row(0);
  }
  return right;
}

Curve ToPower(const Points& points, int degree) {
  // Forward differences: row k is C(degree,k) times the k-th difference at 0.
  Curve power(degree + 1, 3);
  for (int a = 0; a < 3; ++a) {
    double d[7], choose = 1.0;
    for (int i = 0; i < 7; ++i) d[i] = points(i, a);
    for (int k = 0; k <= degree; ++k) {
      power(k, a) = choose * d[0];
      choose = choose * (degree - k) / (k + 1);
      for (int i = 0; i < degree - k; ++i) d[i] = d[i + 1] - d[i];
    }
  }
  return power;
}

}  // namespace chase::planning
