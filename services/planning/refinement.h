#pragma once

#include <vector>

#include "services/planning/candidate_set.h"
#include "services/planning/plan_proof.h"
#include "services/planning/planner_config.h"

namespace chase::planning {

/// Moves the free control points of a feasible plan downhill in the objective of Problem 2: damped
/// Gauss-Newton steps, each shortened until it lowers the cost and is certified anew. Keeps its
/// memory from one plan to the next.
class Refiner {
 public:
  explicit Refiner(const PlannerConfig& config) : config_(config) {}

  /// True when plan and cost changed; the plan is never worse than before and keeps its start.
  bool Improve(const Problem& problem, double sight_from, Curve* plan, Cost* cost);

 private:
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 9, 1>;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 9, 9>;

  /// An obstacle near enough at a quadrature node to cost anything there.
  struct Near {
    int node, obstacle;
    Eigen::Vector3d center;  ///< local
  };

  bool Set(const Problem& problem, const Curve& plan);
  void SetNear();
  Cost CostOf(const Points& b) const;
  void Model(const Points& b, Vector* gradient, Matrix* hessian) const;
  void AddNode(int node, const Points& b, Vector* gradient, Matrix* hessian) const;
  void AddPull(int node, const Eigen::Vector3d& gradient, const Eigen::Matrix3d& hessian, Vector* g,
               Matrix* H) const;
  bool Step(const Vector& direction, Points* b, Curve* plan, Cost* cost);
  Curve PlanOf(const Points& b) const;

  PlannerConfig config_;
  PlanProof proof_;
  CandidateTables tables_;
  const Problem* problem_ = nullptr;
  int free_ = 2;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  Points first_, target_;  // local control points: of the plan as it came, and of the target
  std::vector<Near> near_;
};

}  // namespace chase::planning
