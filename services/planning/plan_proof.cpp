#include "services/planning/plan_proof.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "services/planning/candidate_set.h"
#include "services/planning/certificate.h"
#include "services/planning/small_form.h"

namespace chase::planning {
namespace {

using kernels::kPad;
using math::Positivity;

constexpr int kDepth = 24;

int Padded(int n) { return (std::max(n, 1) + kPad - 1) / kPad * kPad; }

bool IsPositiveDefinite(const Eigen::Matrix3d& R) {
  const double minor = R(0, 0) * R(1, 1) - R(0, 1) * R(0, 1);
  return R.allFinite() && R(0, 0) > 0.0 && minor > 0.0 && R.determinant() > 0.0;
}

}  // namespace

void PlanProof::Reset(const Problem& problem, double sight_from, bool exact) {
  problem_ = &problem;
  exact_sight_ = exact;
  origin_ = problem.target.row(0).transpose();
  rows_.clear();
  usable_ = small_ = linear_ = true;
  center_size_ = 0.0;
  Eigen::Index n = std::max(problem.start.rows(), problem.target.rows());
  for (size_t j = 0; j < problem.obstacles.size(); ++j) {
    const Ellipsoid& e = problem.obstacles[j];
    const int id = static_cast<int>(j);
    const double from = std::max(sight_from, e.sight_from);
    const bool sight = from < 1.0;
    const bool fused = sight && from == e.safety_from && e.safety == e.sight;
    rows_.push_back({id, true, fused, e.safety_from});
    if (sight && !fused) rows_.push_back({id, false, true, from});
    n = std::max(n, e.center.rows());
    linear_ = linear_ && e.center.rows() <= 2;
    for (int a = 0; a < 3; ++a)
      center_size_ = std::max(center_size_, e.center.col(a).cwiseAbs().sum());
  }
  degree_ = std::max(problem.degree, static_cast<int>(n) - 1);
  small_ = degree_ <= kernels::kMaxDegree;
  degree_ = degree_ <= 5 ? 5 : 6;
  input_.n = Padded(static_cast<int>(rows_.size()));
  const auto columns = static_cast<size_t>(input_.n);
  shapes_.resize(6 * columns);
  sums_.resize(columns);
  centers_.resize(6 * columns);
  sight_.resize(columns);
  cleared_.assign(columns, 0);
  for (int column = 0; column < input_.n; ++column) {
    if (rows_.empty()) break;
    PutRow(column, rows_[std::min(static_cast<size_t>(column), rows_.size() - 1)]);
  }
  input_.R = shapes_.data();
  input_.sum_R = sums_.data();
  input_.center = centers_.data();
  input_.sight = sight_.data();
  input_.exact = exact;
  input_.degree = degree_;
  if (!small_ || !MakeLocal(problem.target, degree_, &target_)) return;
  for (int i = 0; i <= degree_; ++i)
    std::copy(target_.point[i], target_.point[i] + 3, input_.target[i]);
}

void PlanProof::PutRow(int column, const Row& row) {
  const Ellipsoid& e = problem_->obstacles[static_cast<size_t>(row.obstacle)];
  const Eigen::Matrix3d& R = row.safety ? e.safety : e.sight;
  const double values[6] = {R(0, 0), 0.5 * (R(0, 1) + R(1, 0)), 0.5 * (R(0, 2) + R(2, 0)),
                            R(1, 1), 0.5 * (R(1, 2) + R(2, 1)), R(2, 2)};
  for (int i = 0; i < 6; ++i) shapes_[static_cast<size_t>(i * input_.n + column)] = values[i];
  sums_[static_cast<size_t>(column)] = R.cwiseAbs().sum();
  sight_[static_cast<size_t>(column)] = row.sight;
  usable_ = usable_ && IsPositiveDefinite(R);
  for (int a = 0; a < 3; ++a) {
    centers_[static_cast<size_t>(a * input_.n + column)] = e.center(0, a) - origin_[a];
    centers_[static_cast<size_t>((3 + a) * input_.n + column)] =
        e.center.rows() > 1 ? e.center(1, a) : 0.0;
  }
}

bool PlanProof::MakeLocal(const Curve& curve, int degree, Local* out) const {
  if (curve.rows() > degree + 1) return false;
  out->size = 0.0;
  Curve local = curve;
  local.row(0) -= origin_.transpose();
  const Points b = ToPoints(local, degree);
  for (int a = 0; a < 3; ++a) {
    out->size = std::max(out->size, curve.col(a).cwiseAbs().sum() + std::abs(origin_[a]));
    for (int i = 0; i <= degree; ++i) out->point[i][a] = b(i, a);
  }
  return true;
}

bool PlanProof::TargetIsOutside(int row) const {
  const Row& r = rows_[static_cast<size_t>(row)];
  Ellipsoid alone = problem_->obstacles[static_cast<size_t>(r.obstacle)];
  if (!r.safety) alone.safety = alone.sight;
  alone.safety_from = r.from;
  return IsSafe(problem_->target, alone, Arithmetic::kCertified);
}

bool PlanProof::RowHolds(const Row& row, const Curve& plan, const Local* p) {
  const Ellipsoid& e = problem_->obstacles[static_cast<size_t>(row.obstacle)];
  Positivity decided = Positivity::kUndecided;
  Local c;
  if (p && MakeLocal(e.center, degree_, &c)) {
    double x[7][3], y[7][3];
    for (int i = 0; i <= degree_; ++i)
      for (int a = 0; a < 3; ++a) {
        x[i][a] = p->point[i][a] - c.point[i][a];
        y[i][a] = target_.point[i][a] - c.point[i][a];
      }
    const double X = p->size + c.size, Y = target_.size + c.size;
    const Eigen::Matrix3d& R = row.safety ? e.safety : e.sight;
    SmallForms forms(degree_, x, X, y, Y, R);
    forms.CutFrom(row.from);
    decided = row.sight ? forms.DecideSight(exact_sight_, kDepth) : forms.DecideSafe(kDepth);
  }
  if (decided != Positivity::kUndecided) return decided == Positivity::kPositive;
  ++n_exact_;
  return (!row.safety || IsSafe(plan, e, Arithmetic::kExactSturm)) &&
         (!row.sight ||
          IsInSight(plan, problem_->target, e, row.from, exact_sight_, Arithmetic::kExactSturm));
}

bool PlanProof::RowHolds(int row, const Curve& plan) {
  Local p{};
  const bool small = small_ && MakeLocal(plan, degree_, &p);
  return usable_ && RowHolds(rows_[static_cast<size_t>(row)], plan, small ? &p : nullptr);
}

bool PlanProof::Holds(const Curve& plan) {
  examined_ = n_exact_ = 0;
  if (!usable_ || !plan.allFinite()) return false;
  if (rows_.empty()) return true;
  Local p{};
  const bool small = small_ && MakeLocal(plan, degree_, &p), bounds = small && linear_;
  if (bounds) {
    for (int i = 0; i <= degree_; ++i) std::copy(p.point[i], p.point[i] + 3, input_.plan[i]);
    input_.size = std::max(p.size, target_.size) + center_size_ + origin_.cwiseAbs().maxCoeff();
    kernels_->prove(input_, cleared_.data());
  }
  for (size_t j = 0; j < rows_.size(); ++j) {
    if (bounds && cleared_[j]) continue;
    ++examined_;
    if (!RowHolds(rows_[j], plan, small ? &p : nullptr)) return false;
  }
  return true;
}

}  // namespace chase::planning
