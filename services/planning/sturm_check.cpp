#include "services/planning/sturm_check.h"

#include <algorithm>

#include "common/math/polynomial.h"

namespace chase::planning {
namespace {

using math::Polynomial;

bool StaysPositive(const Polynomial& f, double from) {
  return math::Evaluate(f, from) > 0.0 && math::CountRootsSturm(f, from, 1.0) == 0;
}

}  // namespace

SturmCheck::SturmCheck(const Curve& target, const Ellipsoid& e, double sight_from,
                       Eigen::Index n_plan)
    : n_(static_cast<int>(std::max({n_plan, target.rows(), e.center.rows()}))),
      center_{},
      shaped_{},
      safety_(e.safety),
      sight_(e.sight),
      safety_from_(e.safety_from),
      sight_from_(std::max(sight_from, e.sight_from)),
      one_form_(safety_ == sight_ && safety_from_ == sight_from_) {
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < e.center.rows(); ++k) center_[a][k] = e.center(k, a);
  if (sight_from_ >= kNoSight) return;
  Columns y;
  Subtract(target, y);
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < n_; ++k)
      shaped_[a][k] = sight_(a, 0) * y[0][k] + sight_(a, 1) * y[1][k] + sight_(a, 2) * y[2][k];
  target_is_outside_ = IsOutside(y, sight_, sight_from_);
}

void SturmCheck::Subtract(const Curve& x, Columns difference) const {
  const int rows = static_cast<int>(x.rows());
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < n_; ++k) difference[a][k] = (k < rows ? x(k, a) : 0.0) - center_[a][k];
}

bool SturmCheck::IsOutside(const Columns& x, const Eigen::Matrix3d& R, double from) const {
  Polynomial f = Polynomial::Zero(2 * n_ - 1);
  f[0] = -1.0;
  for (int i = 0; i < n_; ++i) {
    double Rx[3];
    for (int a = 0; a < 3; ++a) Rx[a] = R(a, 0) * x[0][i] + R(a, 1) * x[1][i] + R(a, 2) * x[2][i];
    f[2 * i] += Rx[0] * x[0][i] + Rx[1] * x[1][i] + Rx[2] * x[2][i];
    for (double& r : Rx) r *= 2.0;
    for (int j = i + 1; j < n_; ++j)
      f[i + j] += Rx[0] * x[0][j] + Rx[1] * x[1][j] + Rx[2] * x[2][j];
  }
  return StaysPositive(f, from);
}

bool SturmCheck::IsBeside(const Columns& x) const {
  Polynomial f = Polynomial::Zero(2 * n_ - 1);
  f[0] = -1.0;
  for (int i = 0; i < n_; ++i)
    for (int j = 0; j < n_; ++j)
      f[i + j] += x[0][i] * shaped_[0][j] + x[1][i] * shaped_[1][j] + x[2][i] * shaped_[2][j];
  return StaysPositive(f, sight_from_);
}

bool SturmCheck::IsSafe(const Curve& plan) const {
  Columns x;
  Subtract(plan, x);
  return IsOutside(x, safety_, safety_from_);
}

bool SturmCheck::IsInSight(const Curve& plan) const {
  if (sight_from_ >= kNoSight) return true;
  if (!target_is_outside_) return false;
  Columns x;
  Subtract(plan, x);
  return IsOutside(x, sight_, sight_from_) && IsBeside(x);
}

bool SturmCheck::IsClear(const Curve& plan) const {
  if (!target_is_outside_) return false;
  Columns x;
  Subtract(plan, x);
  if (!IsOutside(x, safety_, safety_from_)) return false;
  if (sight_from_ >= kNoSight) return true;
  return (one_form_ || IsOutside(x, sight_, sight_from_)) && IsBeside(x);
}

}  // namespace chase::planning
