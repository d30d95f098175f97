#pragma once

#include <Eigen/Core>

namespace chase::baselines {

/// min f(x) subject to g(x) <= 0 and low <= x <= high, with analytic gradients.
class Nlp {
 public:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  virtual ~Nlp() = default;
  virtual int n_variables() const = 0;
  virtual int n_constraints() const = 0;
  /// f, and its gradient where asked for.
  virtual double Cost(const Eigen::VectorXd& x, Eigen::VectorXd* gradient) const = 0;
  /// g, and its Jacobian where asked for; both come in the right size and set to zero.
  virtual void Constraints(const Eigen::VectorXd& x, Eigen::VectorXd* g, Rows* jacobian) const = 0;
  virtual void Bounds(Eigen::VectorXd* low, Eigen::VectorXd* high) const;

  /// Largest g, at least 0; infinity where it is not finite.
  double Violation(const Eigen::VectorXd& x) const;
};

struct NlpOptions {
  int max_evaluations = 100;
  double relative_cost = 1e-3, relative_x = 1e-3;  ///< stop at smaller changes
  double constraint_tolerance = 1e-3;
};

/// NLopt's SLSQP from x0. Its return code is not trusted: the caller looks at Violation(). Never
/// throws; what is not finite comes back as x0.
Eigen::VectorXd Minimise(const Nlp& problem, const Eigen::VectorXd& x0, const NlpOptions& options);

}  // namespace chase::baselines
