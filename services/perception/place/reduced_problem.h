#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "services/perception/place/fit_problem.h"

namespace chase::perception {

/// The problem as a least squares solver asks for it: N + 1 residuals and their Jacobian, with the
/// cost, the gradient and the information of NormalEquations. The last residual has no derivatives:
/// it is what the losses leave of the cost beside the weighed squares (never negative, as Cauchy's
/// loss is concave).
template <int N>
struct ReducedProblem {
  using Scalar = double;
  enum { NUM_RESIDUALS = N + 1, NUM_PARAMETERS = N };
  using Residuals = Eigen::Matrix<double, N + 1, 1>;
  using Jacobian = Eigen::Matrix<double, N + 1, N>;

  const FitProblem& problem;

  Vector9d All(const double* y) const {
    Vector9d all = problem.Start();
    all.head<N>() = Eigen::Map<const Eigen::Matrix<double, N, 1>>(y);
    return all;
  }

  /// False, and all NaN, where the information has no root.
  bool Reduce(const double* y, Residuals* r, Jacobian* J) const {
    const auto normal = problem.Linearised<N>(All(y));
    const Eigen::LLT<Eigen::Matrix<double, N, N>> llt(normal.information);
    r->setConstant(std::numeric_limits<double>::quiet_NaN());
    J->setConstant(std::numeric_limits<double>::quiet_NaN());
    if (llt.info() != Eigen::Success) return false;
    J->template topRows<N>() = llt.matrixU();
    J->template bottomRows<1>().setZero();
    r->template head<N>() = llt.matrixL().solve(normal.gradient);
    const double weighed = r->template head<N>().squaredNorm();
    (*r)[N] = std::sqrt(std::max(0.0, 2.0 * normal.cost - weighed));
    return true;
  }

  /// As ceres::TinySolver calls it, `jacobian` by columns. Without one only the squared norm of the
  /// residuals counts.
  bool operator()(const double* y, double* residuals, double* jacobian) const {
    Residuals r = Residuals::Zero();
    Jacobian J;
    bool ok = true;
    if (jacobian)
      ok = Reduce(y, &r, &J);
    else
      r[N] = std::sqrt(2.0 * problem.Cost(All(y)));
    Eigen::Map<Residuals>(residuals, N + 1) = r;
    if (jacobian) Eigen::Map<Jacobian>(jacobian, N + 1, N) = J;
    return ok;
  }
};

}  // namespace chase::perception
