#include "services/planning/plan_proof.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "services/planning/candidate_set.h"
#include "services/planning/certificate.h"
#include "services/planning/separations.h"

namespace chase::planning {
namespace {

using kernels::kPad;

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
  sight_from_ = sight_from;
  origin_ = problem.target.row(0).transpose();
  laid_out_ = false;
  last_ = {};
}

void PlanProof::AddRows(int obstacle) {
  const Ellipsoid& e = problem_->obstacles[static_cast<size_t>(obstacle)];
  const double from = std::max(sight_from_, e.sight_from);
  const bool sight = from < kNoSight;
  const bool fused = sight && from == e.safety_from && e.safety == e.sight;
  const bool decides = !e.body;
  decides_ = decides_ || decides;
  rows_.push_back({obstacle, true, fused, decides, e.safety_from});
  if (sight && !fused) rows_.push_back({obstacle, false, true, decides, from});
  linear_ = linear_ && e.center.rows() <= 2;
  for (int a = 0; a < 3; ++a)
    center_size_ = std::max(center_size_, e.center.col(a).cwiseAbs().sum());
}

void PlanProof::SetRows(bool all) {
  all_ = all;
  laid_out_ = true;
  rows_.clear();
  usable_ = linear_ = true;
  decides_ = false;
  center_size_ = 0.0;
  if (all) {
    for (int j = 0; j < static_cast<int>(problem_->obstacles.size()); ++j) AddRows(j);
  } else {
    for (const int j : problem_->near) AddRows(j);
  }
  Eigen::Index n = std::max<Eigen::Index>(problem_->degree + 1, problem_->target.rows());
  for (const Row& row : rows_)
    n = std::max(n, problem_->obstacles[static_cast<size_t>(row.obstacle)].center.rows());
  degree_ = static_cast<int>(n) - 1;
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
  input_.exact = exact_sight_;
  input_.degree = degree_;
  if (!small_ || !MakeLocal(problem_->target, degree_, &target_)) return;
  for (int i = 0; i <= degree_; ++i)
    std::copy(target_.point[i], target_.point[i] + 3, input_.target[i]);
}

bool PlanProof::IsWithinReach(const Local& plan) const {
  for (int i = 0; i <= degree_; ++i)
    for (int a = 0; a < 3; ++a) {
      const double x = plan.point[i][a] + origin_[a];
      if (!(x >= problem_->reach->low[a] && x <= problem_->reach->high[a])) return false;
    }
  return true;
}

void PlanProof::PutRow(int column, const Row& row) {
  const Ellipsoid& e = problem_->obstacles[static_cast<size_t>(row.obstacle)];
  const Eigen::Matrix3d& R = row.safety ? e.safety : e.sight;
  const double values[6] = {R(0, 0), 0.5 * (R(0, 1) + R(1, 0)), 0.5 * (R(0, 2) + R(2, 0)),
                            R(1, 1), 0.5 * (R(1, 2) + R(2, 1)), R(2, 2)};
  for (int i = 0; i < 6; ++i) shapes_[static_cast<size_t>(i * input_.n + column)] = values[i];
  double sum = 0.0;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) sum += std::abs(R(a, b));
  sums_[static_cast<size_t>(column)] = sum;
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

bool PlanProof::RowHolds(const Row& row, const Curve& plan, const Local* p, bool exactly) {
  const Ellipsoid& e = problem_->obstacles[static_cast<size_t>(row.obstacle)];
  int decided = 0;
  Local c;
  if (p && MakeLocal(e.center, degree_, &c)) {
    kernels::FormInput in{};
    in.degree = degree_;
    for (int i = 0; i <= degree_; ++i)
      for (int a = 0; a < 3; ++a) {
        in.x[i][a] = p->point[i][a] - c.point[i][a];
        in.y[i][a] = target_.point[i][a] - c.point[i][a];
      }
    in.X = p->size + c.size;
    in.Y = target_.size + c.size;
    const Eigen::Matrix3d& R = row.safety ? e.safety : e.sight;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) in.R[a][b] = R(a, b);
    in.from = row.from;
    in.sight = row.sight;
    in.exact = exact_sight_;
    decided = kernels_->decide(in, kDepth);
  }
  if (decided != 0) return decided > 0;
  if (!exactly) return false;
  ++n_exact_;
  return (!row.safety || IsSafe(plan, e, Arithmetic::kExactSturm)) &&
         (!row.sight ||
          IsInSight(plan, problem_->target, e, row.from, exact_sight_, Arithmetic::kExactSturm));
}

bool PlanProof::RowHolds(int row, const Curve& plan) {
  if (!plan.allFinite() || !IsUsable()) return false;
  const Row& r = rows_[static_cast<size_t>(row)];
  if (last_.obstacle != r.obstacle) last_ = {r.obstacle, -1.0};
  if (!r.decides) return true;
  Local p{};
  const bool small = small_ && MakeLocal(plan, degree_, &p);
  return RowHolds(r, plan, small ? &p : nullptr, true);
}

bool PlanProof::Holds(const Curve& plan, bool exactly) {
  n_exact_ = 0;
  if (!plan.allFinite() || !IsUsable()) return false;
  Local p{};
  bool small = small_ && MakeLocal(plan, degree_, &p);
  if (!all_ && !(small && IsWithinReach(p))) {
    SetRows(true);
    small = small_ && MakeLocal(plan, degree_, &p);
  }
  if (!usable_) return false;
  const bool bounds = small && linear_ && decides_;
  if (bounds) {
    for (int i = 0; i <= degree_; ++i) std::copy(p.point[i], p.point[i] + 3, input_.plan[i]);
    input_.size = std::max(p.size, target_.size) + center_size_ + origin_.cwiseAbs().maxCoeff();
    kernels_->prove(input_, cleared_.data());
  }
  for (size_t j = 0; j < rows_.size(); ++j) {
    if (!rows_[j].decides || (bounds && cleared_[j])) continue;
    if (!RowHolds(rows_[j], plan, small ? &p : nullptr, exactly)) return false;
  }
  return StaysOff(plan, *problem_, sight_from_, &last_, memory_);
}

}  // namespace chase::planning
