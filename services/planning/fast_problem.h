#pragma once

#include <cmath>
#include <vector>

#include "services/planning/candidate_set.h"
#include "services/planning/plan_proof.h"
#include "services/planning/planner_config.h"

namespace chase::planning {

/// A problem laid out for the vector kernels: local frame (origin at the target's start),
/// normalised time, Bernstein form, shapes and candidates in columns. Keeps its memory from one
/// problem to the next.
class FastProblem {
 public:
  FastProblem(const PlannerConfig& config, const kernels::Table& kernels)
      : config_(config), kernels_(kernels), shelf_(config) {}

  /// The candidates and what they cost without J2. False where the kernels do not apply: degrees
  /// above 6, more than 8 steps, coordinates beyond 10 km.
  /// `proof` has been reset to the problem and is kept.
  /// Costs J1 above `limit` may be missing (infinite) until SetAllCosts.
  bool Set(const Problem& problem, PlanProof* proof, float limit = HUGE_VALF);
  void SetAllCosts() { Generate(HUGE_VALF); }
  /// What J3 and J4 need, once a problem; before they are asked for.
  void SetCosts() {
    if (!has_costs_) SetNodes();
    has_costs_ = true;
  }
  /// The obstacles, once a problem; before costs of obstacles or feasibility are asked for. False
  /// when the target is inside a shape while sight is asked: nothing is feasible; or when a shape
  /// is not positive definite, which is beyond the kernels.
  bool SetObstacles();
  bool IsBeyondKernels() const { return beyond_; }

  kernels::Context& context() { return context_; }
  int n_candidates() const { return n_; }

  /// Candidates that differ in the first step only come in groups, `first_choices` a group, in the
  /// order of their indices: those of groups that may hold feasible ones, ascending. After Set
  /// without a limit, or SetAllCosts, only.
  void AliveGroups(std::vector<int>* groups);
  int first_choices() const { return choices_[0]; }

  Points PointsOf(int index) const;
  Curve PlanOf(int index) const;
  Cost CostOf(int index) const;

 private:
  /// Up to a multiple of kPad.
  static int Padded(int n);
  bool SetCandidates();
  void SetShapes(const PlanProof& proof);
  void SetShapeInput(const PlanProof& proof, kernels::ShapeInput* in);
  void SetOrder(const PlanProof& proof);
  void SetNodes();
  void SetRecords();
  void SetRanges();
  void Generate(float limit);
  void SetWhitened(int from, int n, int nx, std::vector<float>* columns) const;
  double ObstacleCost(int node, const double* p) const;

  PlannerConfig config_;
  const kernels::Table& kernels_;
  const Problem* problem_ = nullptr;
  PlanProof* proof_ = nullptr;
  TableShelf shelf_;
  const CandidateTables* tables_ = nullptr;
  kernels::Context context_{};

  int n_ = 0, free_ = 0, record_free_ = 0, n_shapes_ = 0;
  Eigen::Vector3d origin_;
  Points start_, target_;        // local control points; of the start rows 0..3
  std::vector<double> records_;  // [step][choice][kRecord]: see kernels::CandidateInput
  std::vector<int> choices_;     // per step
  double base_[9];               // free points without skeletons
  double low_[9], high_[9];      // of the free points
  double largest_ = 0.0;
  double reach_ = 0.0;  // bounds coordinates and their parts
  bool blocked_ = false, beyond_ = false, has_obstacles_ = false, has_costs_ = false;

  std::vector<kernels::Row> rows_;
  std::vector<int> obstacle_of_;  // row -> obstacle
  std::vector<float> centers_, tables_of_shapes_, factors_, low_plan_, low_target_, low_sight_,
      margin_, slack_;
  std::vector<kernels::NearNode> near_;
  int near_begin_[kernels::kQuadratureNodes + 1];
  std::vector<kernels::Shadow> shadows_;
  std::vector<int> order_, states_;
  std::vector<float> j1_, work_, prefix_, first_, first_whitened_, second_whitened_;
  std::vector<uint32_t> alive_;
};

}  // namespace chase::planning
