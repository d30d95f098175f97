#pragma once

#include "services/planning/problem.h"

namespace chase::planning {

/// Feasibility of plans beside one obstacle as the paper writes it (Jeon 2021, proposition 2): d_p,
/// d_s, d_q > 1 in the power basis, by one Sturm chain in double precision each. Not a proof. What
/// is the same for all plans, d_q and R (q - c), is worked out once.
class SturmCheck {
 public:
  /// For plans of at most `n_plan` coefficients; sight is asked on [max(sight_from, e.sight_from),
  /// 1].
  SturmCheck(const Curve& target, const Ellipsoid& e, double sight_from, Eigen::Index n_plan);

  /// d_p > 1 for the safety shape.
  bool IsSafe(const Curve& plan) const;
  /// d_p, d_s, d_q > 1 for the sight shape.
  bool IsInSight(const Curve& plan) const;
  /// Both; where the two ask for the same d_p it is tested once.
  bool IsClear(const Curve& plan) const;

 private:
  static constexpr int kMaxTerms = Curve::MaxRowsAtCompileTime;
  /// Coefficients of a curve, [axis][power].
  using Columns = double[3][kMaxTerms];

  /// x - c.
  void Subtract(const Curve& x, Columns difference) const;
  bool IsOutside(const Columns& x, const Eigen::Matrix3d& R, double from) const;
  /// d_s > 1.
  bool IsBeside(const Columns& x) const;

  int n_;  ///< coefficients of every curve, with zeros where it has fewer
  Columns center_;
  Columns shaped_;  ///< R (q - c), R the sight shape
  Eigen::Matrix3d safety_, sight_;
  double safety_from_, sight_from_;
  bool one_form_;  ///< whether safety and sight ask for the same d_p
  bool target_is_outside_ = true;
};

}  // namespace chase::planning
