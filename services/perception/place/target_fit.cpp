#include "services/perception/place/target_fit.h"

#include <ceres/ceres.h>

#include <vector>

#include "services/perception/place/reduced_problem.h"

namespace chase::perception {

namespace {

/// The reduced problem as one residual block over the unknowns.
template <int N>
class Cost : public ceres::SizedCostFunction<N + 1, N> {
 public:
  explicit Cost(const FitProblem& problem) : reduced_{problem} {}
  bool Evaluate(double const* const* y, double* residuals, double** jacobians) const override {
    using Jacobian = typename ReducedProblem<N>::Jacobian;
    if (!jacobians || !jacobians[0]) return reduced_(y[0], residuals, nullptr);
    Jacobian J;
    if (!reduced_(y[0], residuals, J.data())) return false;
    Eigen::Map<Eigen::Matrix<double, N + 1, N, Eigen::RowMajor>> by_rows(jacobians[0]);
    by_rows = J;
    return true;
  }

 private:
  ReducedProblem<N> reduced_;
};

ceres::Solver::Options SolverOptions(const FitConfig& config) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.dense_linear_algebra_library_type = ceres::EIGEN;
  options.max_num_iterations = config.max_iterations;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.function_tolerance = 1e-5;
  options.parameter_tolerance = 1e-6;
  return options;
}

/// Of y at the solution, with the losses' weights held.
template <int N>
bool ReadCovariance(double* y, ceres::Problem* problem, Matrix9d* out) {
  ceres::Covariance::Options options;
  options.algorithm_type = ceres::DENSE_SVD;
  options.num_threads = 1;
  ceres::Covariance covariance(options);
  Eigen::Matrix<double, N, N> C;
  const std::vector<const double*> blocks = {y};
  if (!covariance.Compute(blocks, problem) || !covariance.GetCovarianceBlock(y, y, C.data()))
    return false;
  out->topLeftCorner<N, N>() = 0.5 * (C + C.transpose());
  return true;
}

template <int N>
FitResult Solve(const FitProblem& fit, const FitConfig& config, Vector9d y) {
  ceres::Problem problem;
  problem.AddResidualBlock(new Cost<N>(fit), nullptr, y.data());
  ceres::Solver::Summary summary;
  ceres::Solve(SolverOptions(config), &problem, &summary);
  Matrix9d covariance = Matrix9d::Zero();
  if (!summary.IsSolutionUsable() || !y.allFinite() ||
      !ReadCovariance<N>(y.data(), &problem, &covariance))
    return {};
  return fit.Read(y, covariance, summary.final_cost);
}

}  // namespace

FitResult FitTarget(const FitInput& input, const FitConfig& config, const FitResult* start) {
  const FitProblem fit(input, config);
  if (!fit.ok()) return {};
  const Vector9d y = start ? Unknowns(start->posterior, start->shape) : fit.Start();
  if (fit.unknowns() == 9) return Solve<9>(fit, config, y);
  return fit.unknowns() == 7 ? Solve<7>(fit, config, y) : Solve<6>(fit, config, y);
}

}  // namespace chase::perception
