#include "test/baselines/nlp.h"

#include <nlopt.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

namespace chase::baselines {
namespace {

using Eigen::VectorXd;

double CostCallback(unsigned n, const double* x, double* gradient, void* data) {
  const auto* problem = static_cast<const Nlp*>(data);
  const VectorXd at = Eigen::Map<const VectorXd>(x, n);
  if (!gradient) return problem->Cost(at, nullptr);
  VectorXd slope = VectorXd::Zero(n);
  const double cost = problem->Cost(at, &slope);
  Eigen::Map<VectorXd>(gradient, n) = slope;
  return cost;
}

void ConstraintCallback(unsigned m, double* result, unsigned n, const double* x, double* gradient,
                        void* data) {
  const auto* problem = static_cast<const Nlp*>(data);
  const VectorXd at = Eigen::Map<const VectorXd>(x, n);
  VectorXd g = VectorXd::Zero(m);
  if (!gradient) {
    problem->Constraints(at, &g, nullptr);
  } else {
    Nlp::Rows rows = Nlp::Rows::Zero(m, n);
    problem->Constraints(at, &g, &rows);
    Eigen::Map<Nlp::Rows>(gradient, m, n) = rows;
  }
  Eigen::Map<VectorXd>(result, m) = g;
}

}  // namespace

void Nlp::Bounds(VectorXd* low, VectorXd* high) const {
  low->setConstant(-HUGE_VAL);
  high->setConstant(HUGE_VAL);
}

double Nlp::Violation(const VectorXd& x) const {
  if (!x.allFinite()) return HUGE_VAL;
  VectorXd g = VectorXd::Zero(n_constraints());
  Constraints(x, &g, nullptr);
  if (!g.allFinite()) return HUGE_VAL;
  return g.size() > 0 ? std::max(0.0, g.maxCoeff()) : 0.0;
}

VectorXd Minimise(const Nlp& problem, const VectorXd& x0, const NlpOptions& options) {
  const auto n = static_cast<unsigned>(problem.n_variables());
  const auto m = static_cast<size_t>(problem.n_constraints());
  VectorXd low(n), high(n);
  problem.Bounds(&low, &high);
  VectorXd x = x0.cwiseMax(low).cwiseMin(high);
  const std::unique_ptr<nlopt_opt_s, void (*)(nlopt_opt)> solver(nlopt_create(NLOPT_LD_SLSQP, n),
                                                                 nlopt_destroy);
  void* data = const_cast<Nlp*>(&problem);  // NLopt's interface; the problem stays as it is
  const std::vector<double> tolerance(m, options.constraint_tolerance);
  nlopt_set_min_objective(solver.get(), CostCallback, data);
  if (m > 0)
    nlopt_add_inequality_mconstraint(solver.get(), static_cast<unsigned>(m), ConstraintCallback,
                                     data, tolerance.data());
  nlopt_set_lower_bounds(solver.get(), low.data());
  nlopt_set_upper_bounds(solver.get(), high.data());
  nlopt_set_ftol_rel(solver.get(), options.relative_cost);
  nlopt_set_xtol_rel(solver.get(), options.relative_x);
  nlopt_set_maxeval(solver.get(), options.max_evaluations);
  double cost = 0.0;
  nlopt_optimize(solver.get(), x.data(), &cost);  // x is of use whatever this returns
  return x.allFinite() ? x : x0;
}

}  // namespace chase::baselines
