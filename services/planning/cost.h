#pragma once

#include <vector>

#include "services/planning/problem.h"

namespace chase::planning {

/// Gauss-Legendre nodes and weights on [0,1].
constexpr int kNodes = 20;
struct Quadrature {
  double tau[kNodes];
  double weight[kNodes];
};
const Quadrature& GaussNodes();

/// J4's integrand is singular where the drone passes over the target; nearer than this the
/// horizontal distance counts as this much. (The paper's formula has no such floor.)
constexpr double kYawDistanceFloor = 0.05;  // m

/// Objective of Problem 2: J1 (orders 2 and 3) in closed form, J2 to J4 by quadrature.
Cost Evaluate(const PlannerConfig& config, const Problem& problem, const Curve& plan);

/// The same for many plans of one problem: what does not depend on the plan is worked out once.
class Objective {
 public:
  Objective(const PlannerConfig& config, const Problem& problem);
  Cost operator()(const Curve& plan) const;

 private:
  PlannerConfig config_;
  double duration_;
  Eigen::Vector3d target_[kNodes], target_slope_[kNodes];  ///< m; m per unit of tau
  std::vector<Eigen::Vector3d> centers_;                   ///< of all obstacles, node by node
  std::vector<Eigen::Matrix3d> shapes_;
};

/// c(l) of eq. (3).
double ObstacleCost(const PlannerConfig& config, double distance);

}  // namespace chase::planning
