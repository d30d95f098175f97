#pragma once

#include <Eigen/Core>
#include <vector>

#include "services/planning/cost.h"
#include "services/planning/problem.h"

namespace chase::planning {

/// Control points of a curve, rows b0..bM; those above its degree are zero.
using Points = Eigen::Matrix<double, 7, 3>;

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
  /// w1 J1 = |root (x - best b)|^2 + b' rest b over the free points x of an axis, b its first four.
  Eigen::Matrix3d root;               ///< upper triangular
  Eigen::Matrix<double, 3, 4> best;   ///< what makes J1 least
  Eigen::Matrix4d rest;               ///< w1 J1 there = b' rest b
  double phi[kNodes][7];              ///< Bernstein polynomials at the quadrature nodes
  double slope[kNodes][7];            ///< and their derivatives with respect to t, 1/s
  static constexpr int kPadded = 24;  ///< nodes, the rest zero
  double phi_of[7][kPadded], slope_of[7][kPadded];  ///< the same by polynomial
  double sample_of[7][kPadded];                     ///< and at equally spaced instants
  static double SampleAt(int k) { return (k + 1.0) / kPadded; }

  CandidateTables() = default;
  CandidateTables(const PlannerConfig& config, int degree, int steps, double duration);
};

/// sum += table' b over the points first..last of one axis: values at all nodes.
inline void AddAtNodes(const double (*table)[CandidateTables::kPadded], const Points& b, int first,
                       int last, int axis, double* sum) {
  for (int i = first; i <= last; ++i) {
    const double x = b(i, axis);
    for (int k = 0; k < CandidateTables::kPadded; ++k) sum[k] += table[i][k] * x;
  }
}

/// The tables that were asked for last.
class TableShelf {
 public:
  explicit TableShelf(const PlannerConfig& config) : config_(config) {}
  /// Valid until another seven have been asked for.
  const CandidateTables& Get(int degree, int steps, double duration);

 private:
  PlannerConfig config_;
  std::vector<CandidateTables> tables_;
  size_t next_ = 0;
};

/// Of the first n points, grown by `beyond` m.
Box BoxOf(const Points& points, int n, double beyond);

/// Whether the control points of the curve, of degree 6 at most, lie in the box.
bool Contains(const Box& box, const Curve& curve);

/// False only when a box of these half sides about the centre's path, `by` times as large, has no
/// point in the box.
bool MayTouch(const Box& box, const Curve& center, const Eigen::Array3d& half, double by);

/// Sets `reach` to what holds all candidates, the target, and plans whose control points are at
/// most `beyond` m from a candidate's; and `near` to the obstacles whose bounding boxes come into
/// it, grown to where they cost anything. The others neither touch the box nor hide anything in it:
/// it is convex. Does nothing where degrees are above the candidates', nor for the paper's bound on
/// sight, which may fail for them.
void LimitToReach(const PlannerConfig& config, const CandidateTables& tables, double beyond,
                  Problem* problem);

/// Control points of the curve at degree 5 or 6.
Points ToPoints(const Curve& power, int degree);
Curve ToPower(const Points& points, int degree);
/// Of degree 6: leaves those of the first half and returns those of the second (de Casteljau).
Points Halve(Points* points);

}  // namespace chase::planning
