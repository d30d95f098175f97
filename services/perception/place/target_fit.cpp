#include "services/perception/place/target_fit.h"

#include <ceres/tiny_solver.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "services/perception/place/reduced_problem.h"

namespace chase::perception {

namespace {

constexpr double kTolerance = 1e-5;       // of the cost
constexpr double kVagueYaw = M_PI / 8.0;  // rad, standard deviation: half of what one start covers

template <int N>
FitResult Solve(const FitProblem& problem, const FitConfig& config, double turn = 0.0) {
  using Vector = Eigen::Matrix<double, N, 1>;
  ceres::TinySolver<ReducedProblem<N>> solver;
  solver.options.max_num_iterations = config.max_iterations + 1;  // it counts the start
  solver.options.function_tolerance = 2.0 * kTolerance;
  Vector9d y = problem.Start();
  y[kYawAt] += turn;
  Vector solved = y.head<N>();
  const double cost = solver.Solve({problem}, &solved).final_cost;
  if (!solved.allFinite()) return {};
  y.head<N>() = solved;
  const Eigen::LLT<Eigen::Matrix<double, N, N>> llt(problem.Linearised<N>(y).information);
  if (llt.info() != Eigen::Success) return {};
  Matrix9d covariance = Matrix9d::Zero();
  covariance.topLeftCorner<N, N>() = llt.solve(Eigen::Matrix<double, N, N>::Identity());
  return problem.Read(y, covariance, cost);
}

/// Of a heading hardly known every eighth of a turn is tried: a face seen at one angle may look
/// like one at another.
FitResult SolveBox(const FitProblem& problem, const FitConfig& config, double yaw_variance) {
  FitResult best = Solve<7>(problem, config);
  if (yaw_variance < kVagueYaw * kVagueYaw) return best;
  for (const double turn : {-M_PI / 8.0, M_PI / 8.0, M_PI / 4.0}) {
    const FitResult other = Solve<7>(problem, config, turn);
    if (other.ok && (!best.ok || other.cost < best.cost)) best = other;
  }
  return best;
}

}  // namespace

FitResult FitTarget(const FitInput& input, const FitConfig& config) {
  const FitProblem problem(input, config);
  if (!problem.ok()) return {};
  if (problem.unknowns() == 9) return Solve<9>(problem, config);
  return problem.unknowns() == 7 ? SolveBox(problem, config, input.shape.yaw_variance)
                                 : Solve<6>(problem, config);
}

}  // namespace chase::perception
