#include "services/perception/place/target_fit.h"

#include <ceres/tiny_solver.h>
#include <ceres/tiny_solver_autodiff_function.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "services/perception/place/fit_problem.h"

namespace chase::perception {

namespace {

constexpr double kVagueYaw = M_PI / 8.0;  // rad, standard deviation: half of what one start covers

FitResult Solve(const FitProblem& problem, const Effort& effort, double turn) {
  using Function = ceres::TinySolverAutoDiffFunction<FitProblem, Eigen::Dynamic, kUnknowns>;
  ceres::TinySolver<Function> solver;
  solver.options.max_num_iterations = effort.iterations + 1;  // it counts the start
  solver.options.function_tolerance = 2.0 * effort.tolerance;
  Vector7d y = problem.Start();
  y[kYawAt] += turn;
  const double cost = solver.Solve(Function(problem), &y).final_cost;
  return y.allFinite() ? problem.Read(y, cost) : FitResult{};
}

}  // namespace

FitResult FitTarget(const FitInput& input, const FitConfig& config, const Effort& effort) {
  const FitProblem problem(input, config);
  if (!problem.ok()) return {};
  FitResult best = Solve(problem, effort, 0.0);
  if (!input.shape.box() || input.shape.yaw_variance < kVagueYaw * kVagueYaw) return best;
  // Of a heading hardly known every eighth of a turn is tried: a face seen at one angle may look
  // like one at another.
  for (const double turn : {-M_PI / 8.0, M_PI / 8.0, M_PI / 4.0}) {
    const FitResult other = Solve(problem, effort, turn);
    if (other.ok && (!best.ok || other.cost < best.cost)) best = other;
  }
  return best;
}

}  // namespace chase::perception
