#pragma once

#include <vector>

#include "services/planning/candidate_set.h"
#include "services/planning/cuts.h"
#include "services/planning/plan_proof.h"
#include "services/planning/planner_config.h"

namespace chase::planning {

/// Moves the free control points of plans downhill in the objective of Problem 2 by damped
/// Gauss-Newton steps. Obstacles near the plans are taken somewhat larger than they are
/// (config.refine_room) where start and target leave that room, so that the result can still be
/// carried on when the target moves a little otherwise than expected. Keeps its memory from one
/// plan to the next.
class Refiner {
 public:
  explicit Refiner(const PlannerConfig& config) : config_(config), shelf_(config) {}

  /// As for PlanProof.
  void Remember(SeparationMemory* memory) { proof_.Remember(memory); }

  /// How far Improve may move a control point, m; Repair goes further, within the problem's reach.
  static constexpr double kReach = 0.5;

  /// Keeps a pointer to `problem`. False where its degrees do not fit: nothing can be improved.
  bool Reset(const Problem& problem, double sight_from);

  /// Up to `steps` steps, then the proof; where that fails, around what is in the way, or, for a
  /// limit, part of the way. True when the plan moved: it keeps its start, is certified against the
  /// problem's limits and the enlarged obstacles, and costs less by 0.02 % at least. Else it is as
  /// before. The plan given need not be feasible. `cost` is that of the plan in any case.
  bool Improve(int steps, Curve* plan, Cost* cost);

  /// A certified plan near the model's least, around what is in the way, for a plan that is not
  /// certified; it may cost more. True when one was found.
  bool Repair(Curve* plan, Cost* cost);

 private:
  using Free = Eigen::Matrix<double, 9, 1>;  ///< free control points, 3 f + axis, local

  void SetObjective();
  void SetPlan(const Curve& plan);
  void SetNear(const Points& b);
  Cost CostOf(const Free& x) const;
  /// Gauss-Newton model at some x: Cholesky factor of the curvature, L y = -gradient.
  struct Model {
    double L[9][9], inverse[9], y[9];
  };
  /// False where the curvature is not positive definite.
  bool MakeModel(const Free& x, Model* model) const;
  Free StepOf(const Model& model) const;
  /// The least of the model beside the shapes that a plan with free points x enters: tangents lead
  /// around them, again where that enters others. True when it is certified and costs less than
  /// `limit`.
  bool GoAround(const Free& x, double limit, Curve* plan, Cost* cost);
  Free Moved(const Free& x, const Free& step, double share) const;
  bool IsProven(const Free& x, Curve* plan);
  void Descend(int steps, Free* x, Cost* cost);

  PlannerConfig config_;
  TableShelf shelf_;
  const kernels::Table& kernels_ = kernels::Kernels();
  const CandidateTables* tables_ = nullptr;
  const Problem* problem_ = nullptr;
  Problem roomy_;
  Enlargements enlargements_;
  PlanProof proof_;
  int free_ = 2;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  Points start_, target_;  ///< local control points; of the start rows 0..3
  Free first_;             ///< of the plan as it came
  Model model_;            ///< there
  bool has_model_ = false;
  double reach_ = kReach;
  Cuts cuts_;
  bool cuts_ready_ = false;
  kernels::ObjectiveInput input_{};
  std::vector<double> near_;
};

}  // namespace chase::planning
