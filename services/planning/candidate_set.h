#pragma once

#include <Eigen/Core>
#include <vector>

#include "services/planning/cost.h"
#include "services/planning/problem.h"

namespace chase::planning {

/// What depends on horizon, degree and number of steps only. Candidates in Bernstein form over
/// normalised time: the start fixes b0..b3, and the objective (11) of Jeon 2021 makes the free
/// points b4.. affine in those and in the skeletons: b_f = sum_i fixed(f,i) b_i + sum_n pull(f,n)
/// u_n. This is the reduced form of the paper's KKT system, well conditioned (1e4 instead of 1e10).
struct CandidateTables {
  int degree = 0, steps = 0;
  double duration = 0.0;
  Eigen::Matrix<double, Eigen::Dynamic, 4, 0, 3, 4> fixed;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 8> pull;
  Eigen::Matrix<double, 7, 7> smooth;  ///< w1 J1 = sum over axes b' smooth b
  double phi[kNodes][7];               ///< Bernstein polynomials at the quadrature nodes
  double slope[kNodes][7];             ///< and their derivatives with respect to t, 1/s

  CandidateTables() = default;
  CandidateTables(const PlannerConfig& config, int degree, int steps, double duration);
};

/// Control points, rows b0..bM, of a curve of lower or equal degree.
using Points = Eigen::Matrix<double, 7, 3>;
Points ToPoints(const Curve& power, int degree);
Curve ToPower(const Points& points, int degree);

}  // namespace chase::planning
