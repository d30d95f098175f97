#include "services/perception/place/target_fit.h"

#include <ceres/tiny_solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "services/perception/place/fit_problem.h"

namespace chase::perception {

namespace {

constexpr double kVagueYaw = M_PI / 8.0;  // rad, standard deviation: half of what one start covers

/// The problem as a least squares solver asks for it: residuals and their Jacobian, by columns,
/// with the cost, the gradient and the information of NormalEquations. The last residual has no
/// derivatives: it is what the losses leave of the cost beside the weighed squares (never negative,
/// as Cauchy's loss is concave). What was asked for last is kept: TinySolver asks for the cost of a
/// step first, and for the Jacobian where it takes the step.
class ReducedProblem {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = 8, NUM_PARAMETERS = 7 };

  explicit ReducedProblem(const FitProblem& problem) : problem_(problem) {}

  const NormalEquations& At(const Vector7d& y) const {
    if (y != at_) normal_ = problem_.Linearised(y);
    at_ = y;
    return normal_;
  }

  /// False, and all NaN, where the information has no root. Without a Jacobian only the squared
  /// norm of the residuals counts.
  bool operator()(const double* y, double* residuals, double* jacobian) const {
    Eigen::Map<Eigen::Matrix<double, 8, 1>> r(residuals);
    const NormalEquations& normal = At(Eigen::Map<const Vector7d>(y));
    r.setZero();
    r[7] = std::sqrt(2.0 * normal.cost);
    if (!jacobian) return true;
    Eigen::Map<Eigen::Matrix<double, 8, 7>> J(jacobian);
    const Eigen::LLT<Matrix7d> llt(normal.information);
    r.setConstant(std::numeric_limits<double>::quiet_NaN());
    J.setConstant(std::numeric_limits<double>::quiet_NaN());
    if (llt.info() != Eigen::Success) return false;
    J.topRows<7>() = llt.matrixU();
    J.bottomRows<1>().setZero();
    r.head<7>() = llt.matrixL().solve(normal.gradient);
    r[7] = std::sqrt(std::max(0.0, 2.0 * normal.cost - r.head<7>().squaredNorm()));
    return true;
  }

 private:
  const FitProblem& problem_;
  mutable Vector7d at_ = Vector7d::Constant(std::numeric_limits<double>::quiet_NaN());
  mutable NormalEquations normal_;  // at it
};

FitResult Solve(const FitProblem& problem, const Effort& effort, double turn) {
  const ReducedProblem reduced(problem);
  ceres::TinySolver<ReducedProblem> solver;
  solver.options.max_num_iterations = effort.iterations + 1;  // it counts the start
  solver.options.function_tolerance = 2.0 * effort.tolerance;
  Vector7d y = problem.Start();
  y[kYawAt] += turn;
  const double cost = solver.Solve(reduced, &y).final_cost;
  if (!y.allFinite()) return {};
  const Eigen::LLT<Matrix7d> llt(reduced.At(y).information);
  if (llt.info() != Eigen::Success) return {};
  return problem.Read(y, llt.solve(Matrix7d::Identity()), cost);
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
