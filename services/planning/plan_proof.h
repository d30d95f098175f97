#pragma once

#include <cstdint>
#include <vector>

#include "services/planning/fast_kernels.h"
#include "services/planning/separations.h"

namespace chase::planning {

/// Proves plans safe and in sight of the target, one problem, many plans in a row. What stands for
/// a solid is kept off by planes in the Minkowski sum. An ellipsoid that stands for itself is so
/// only where bounds that include all rounding, or exact arithmetic, say so: first planes
/// that separate and bounds on d_p, d_q, d_s (many shapes at a time), then subdivision, then
/// Sturm's theorem in integers. The verdict is that of IsFeasible with exact arithmetic, limits
/// aside.
class PlanProof {
 public:
  /// A shape of one obstacle and what it is asked: one row where safety and sight ask the same,
  /// else two.
  struct Row {
    int obstacle;
    bool safety, sight;
    bool decides;  ///< else the shape only sorts candidates, and planes about its body decide
    double from;   ///< tau
  };

  explicit PlanProof(const kernels::Table& kernels = kernels::Kernels()) : kernels_(&kernels) {}

  /// Keeps a pointer to `problem`, which must not change until the next Reset. Sight is asked from
  /// tau = `sight_from` on (1: never); `exact` as for IsInSight. Where the problem has a reach,
  /// there are rows for the obstacles near it only, until a plan that leaves it is asked for.
  void Reset(const Problem& problem, double sight_from, bool exact);
  /// Keeps there what separates the last plan from what is near it.
  void Remember(SeparationMemory* memory) { memory_ = memory; }

  /// Without `exactly`, what bounds and subdivision leave open counts as refused: for plans that
  /// may be dispensed with, because the integers take milliseconds.
  bool Holds(const Curve& plan, bool exactly = true);
  /// The same for one row only, where its shape decides; Holds asks its obstacle first.
  bool RowHolds(int row, const Curve& plan);
  /// Whether the target itself stays outside the row's shape while sight is asked.
  bool TargetIsOutside(int row) const;

  /// False where a shape is not finite and positive definite: nothing is proven then. To be called
  /// before what follows: rows are laid out when they are first needed.
  bool IsUsable() {
    if (!laid_out_) SetRows(!problem_->reach);
    return usable_;
  }
  const std::vector<Row>& rows() const { return rows_; }
  /// [6][padded]: R00 R01 R02 R11 R12 R22 of the rows, the last repeated; one column at least.
  const double* shapes() const { return shapes_.data(); }
  /// [2][3][padded]: of their centres, local, the value at tau = 0 and the rate; where IsLinear.
  const double* centers() const { return centers_.data(); }
  const uint8_t* asks_sight() const { return sight_.data(); }  ///< [padded]
  bool IsLinear() const { return linear_; }
  int padded() const { return input_.n; }
  /// Rows of the last Holds that took exact arithmetic.
  int exact() const { return n_exact_; }

 private:
  struct Local {
    double point[kernels::kMaxDegree + 1][3];
    double size;  ///< largest sum of absolute power coefficients of a coordinate
  };
  void SetRows(bool all);
  void AddRows(int obstacle);
  bool IsWithinReach(const Local& plan) const;
  bool MakeLocal(const Curve& curve, int degree, Local* out) const;
  void PutRow(int column, const Row& row);
  /// `p`: the plan's control points; null where its degree is too high for them.
  bool RowHolds(const Row& row, const Curve& plan, const Local* p, bool exactly);

  const kernels::Table* kernels_;
  const Problem* problem_ = nullptr;
  SeparationMemory* memory_ = nullptr;
  bool exact_sight_ = true, usable_ = false, small_ = false, linear_ = true, all_ = true,
       laid_out_ = false, decides_ = false;
  int degree_ = 5, n_exact_ = 0;
  Refusal last_;  ///< of the last plan that touched something
  double sight_from_ = 0.0;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  Local target_{};
  double center_size_ = 0.0;
  std::vector<Row> rows_;
  std::vector<double> shapes_, sums_, centers_;
  std::vector<uint8_t> sight_, cleared_;
  kernels::ProofInput input_{};
};

}  // namespace chase::planning
