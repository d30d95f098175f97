#include "services/perception/quick_fit.h"

#include <ceres/tiny_solver.h>

#include <Eigen/Cholesky>

#include "services/perception/reduced_problem.h"

namespace chase::perception {

namespace {

constexpr double kTolerance = 1e-5;  // of the cost

template <int N>
FitResult Solve(const CylinderProblem& problem, const FitConfig& config) {
  using Vector = Eigen::Matrix<double, N, 1>;
  ceres::TinySolver<ReducedProblem<N>> solver;
  solver.options.max_num_iterations = config.max_iterations + 1;  // it counts the start
  solver.options.function_tolerance = 2.0 * kTolerance;
  Vector8d y = problem.Start();
  Vector solved = y.head<N>();
  const double cost = solver.Solve({problem}, &solved).final_cost;
  if (!solved.allFinite()) return {};
  y.head<N>() = solved;
  const Eigen::LLT<Eigen::Matrix<double, N, N>> llt(problem.Linearised<N>(y).information);
  if (llt.info() != Eigen::Success) return {};
  Matrix8d covariance = Matrix8d::Zero();
  covariance.topLeftCorner<N, N>() = llt.solve(Eigen::Matrix<double, N, N>::Identity());
  return problem.Read(y, covariance, cost);
}

}  // namespace

FitResult QuickFit(const FitInput& input, const FitConfig& config) {
  const CylinderProblem problem(input, config);
  if (!problem.ok()) return {};
  return config.estimate_shape ? Solve<8>(problem, config) : Solve<6>(problem, config);
}

}  // namespace chase::perception
