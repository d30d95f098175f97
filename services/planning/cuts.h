#pragma once

#include <vector>

#include "services/planning/candidate_set.h"
#include "services/planning/plan_proof.h"

namespace chase::planning {

/// Half-spaces of free control points (3 f + axis, up to 9) that lead a plan clear of obstacles and
/// shadows that it would enter: tangents to what the rows of a proof ask, at the instant of the
/// deepest entry. A proof has to follow; tangents only say where to move.
class Cuts {
 public:
  static constexpr int kMost = 12;

  explicit Cuts(const kernels::Table& kernels = kernels::Kernels()) : kernels_(&kernels) {}

  /// Local control points of start (rows 0..3) and target; keeps pointers to all but the points.
  void Reset(const CandidateTables& tables, const PlanProof& proof, const Points& start,
             const Points& target);

  void Clear() { n_ = 0; }
  int size() const { return n_; }

  /// Adds a cut for every row that the plan with free points `x` enters, tangent at `base`.
  /// Returns how many.
  int Add(const double* x, const double* base);

  /// The least of (z - y)' (z - y) over all z = L' (x - origin) that keep the cuts, in place of y;
  /// L: lower Cholesky factor, with the inverse of its diagonal. By Hildreth's method.
  void Project(const double (*L)[9], const double* inverse, const double* origin, double* y) const;

 private:
  struct Cut {
    double a[9], b;  // a' x >= b
  };
  struct Sighting {
    double squared;  // distance in the row's shape
    double slope[9];
  };
  Sighting At(int row, double tau, const double* x) const;

  const kernels::Table* kernels_;
  const CandidateTables* tables_ = nullptr;
  const PlanProof* proof_ = nullptr;
  Points start_, target_;
  kernels::ClearanceInput input_{};
  std::vector<double> values_, least_;
  Cut cuts_[kMost];
  int n_ = 0;
};

}  // namespace chase::planning
