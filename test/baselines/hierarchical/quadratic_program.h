#pragma once

#include <Eigen/Core>
#include <optional>

namespace chase::baselines {

/// min 1/2 x'Hx + g'x subject to A x = b and C x >= d. H need only be positive definite where
/// A x = 0.
struct QuadraticProgram {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
  Eigen::MatrixXd C;
  Eigen::VectorXd d;
};

/// Dual active-set method of Goldfarb and Idnani (1983) in the null space of A. Nothing when the
/// constraints contradict each other or `max_steps` changes of the active set did not do.
std::optional<Eigen::VectorXd> Solve(const QuadraticProgram& qp, int max_steps = 2000);

}  // namespace chase::baselines
