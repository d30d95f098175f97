#include "services/planning/candidate_set.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "common/math/bernstein.h"

namespace chase::planning {
namespace {

double Bernstein(int n, int i, double x) {
  if (i < 0 || i > n) return 0.0;
  return math::Binomial(n, i) * std::pow(x, i) * std::pow(1.0 - x, n - i);
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
  for (int k = 0; k < kNodes; ++k)
    for (int i = 0; i < n; ++i) {
      const double x = GaussNodes().tau[k];
      phi[k][i] = Bernstein(degree, i, x);
      slope[k][i] =
          degree / duration * (Bernstein(degree - 1, i - 1, x) - Bernstein(degree - 1, i, x));
    }
}

Points ToPoints(const Curve& power, int degree) {
  Points b = Points::Zero();
  for (int j = 0; j <= degree; ++j) {
    double weight = 1.0;  // C(j,k) / C(degree,k)
    for (int k = 0; k <= j && k < power.rows(); ++k) {
      b.row(j) += weight * power.row(k);
      weight *= static_cast<double>(j - k) / (degree - k);
    }
  }
  return b;
}

Curve ToPower(const Points& points, int degree) {
  // Forward differences: row k is C(degree,k) times the k-th difference at 0.
  Points d = points;
  Curve power(degree + 1, 3);
  for (int k = 0; k <= degree; ++k) {
    power.row(k) = math::Binomial(degree, k) * d.row(0);
    for (int i = 0; i < degree - k; ++i) d.row(i) = d.row(i + 1) - d.row(i);
  }
  return power;
}

}  // namespace chase::planning
