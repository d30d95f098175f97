#include "services/planning/refinement.h"

#include <algorithm>
#include <cmath>

#include "services/planning/limits.h"

namespace chase::planning {
namespace {

constexpr double kLeast = 2e-4;  // relative gain of a step that is worth another
constexpr double kDamping = 1e-6;

bool IsWorthIt(const Cost& before, const Cost& after) {
  return before.total - after.total >= kLeast * before.total;
}

// Solves A x = -g by Cholesky's method, n <= 9, the lower triangle of A given; overwrites A. False
// where A is not positive definite.
bool SolveDownhill(int n, double (*A)[9], const double* g, double* x) {
  double inverse[9];
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = A[i][j];
      for (int k = 0; k < j; ++k) sum -= A[i][k] * A[j][k];
      if (j < i) {
        A[i][j] = sum * inverse[j];
      } else {
        if (!(sum > 0.0)) return false;
        A[i][i] = std::sqrt(sum);
        inverse[i] = 1.0 / A[i][i];
      }
    }
    double y = -g[i];
    for (int k = 0; k < i; ++k) y -= A[i][k] * x[k];
    x[i] = y * inverse[i];
  }
  for (int i = n - 1; i >= 0; --i) {
    for (int k = i + 1; k < n; ++k) x[i] -= A[k][i] * x[k];
    x[i] *= inverse[i];
  }
  return true;
}

}  // namespace

bool Refiner::Reset(const Problem& problem, double sight_from) {
  problem_ = &problem;
  const int M = problem.degree;
  if (M < 5 || M > 6 || problem.target.rows() > M + 1) return false;
  free_ = M - 3;
  const int steps = std::max(1, static_cast<int>(problem.skeletons.size()));
  tables_ = &shelf_.Get(M, steps, problem.duration);
  origin_ = problem.target.row(0).transpose();
  SetObjective();
  // The paper's bound on sight may hold for larger shapes only.
  roomy_ = WithRoom(problem, config_.exact_visibility ? config_.refine_room : 0.0);
  proof_.Reset(roomy_, sight_from, config_.exact_visibility);
  return true;
}

void Refiner::SetObjective() {
  const int M = tables_->degree;
  Curve start = problem_->start, target = problem_->target;
  start.row(0) -= origin_.transpose();
  target.row(0).setZero();
  start_ = ToPoints(start, M);
  const Points their = ToPoints(target, M);
  kernels::ObjectiveInput& in = input_;
  in.free = free_;
  in.rest = 0.0;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) in.rest += tables_->smooth(i, j) * start_.row(i).dot(start_.row(j));
  for (int f = 0; f < free_; ++f) {
    for (int g = 0; g < free_; ++g) in.smooth[f][g] = tables_->smooth(4 + f, 4 + g);
    for (int a = 0; a < 3; ++a) {
      in.pull[f][a] = 0.0;
      for (int i = 0; i < 4; ++i) in.pull[f][a] += tables_->smooth(4 + f, i) * start_(i, a);
    }
  }
  for (int k = 0; k < kernels::kPaddedNodes; ++k)
    in.weight[k] = k < kNodes ? problem_->duration * GaussNodes().weight[k] : 0.0;
  std::copy(&tables_->phi_of[4][0], tables_->phi_of[4 + free_ - 1] + kernels::kPaddedNodes,
            &in.phi[0][0]);
  std::copy(&tables_->slope_of[4][0], tables_->slope_of[4 + free_ - 1] + kernels::kPaddedNodes,
            &in.slope[0][0]);
  for (int a = 0; a < 3; ++a) {
    double target_at[kernels::kPaddedNodes] = {}, target_rate[kernels::kPaddedNodes] = {};
    std::fill(in.at[a], in.at[a] + kernels::kPaddedNodes, 0.0);
    AddAtNodes(tables_->phi_of, start_, 0, 3, a, in.at[a]);
    AddAtNodes(tables_->phi_of, their, 0, M, a, target_at);
    for (int k = 0; k < kernels::kPaddedNodes; ++k)
      in.rel[a][k] = k < kNodes ? in.at[a][k] - target_at[k] : 1.0;  // anything but zero
    if (a == 2) continue;
    std::fill(in.rate[a], in.rate[a] + kernels::kPaddedNodes, 0.0);
    AddAtNodes(tables_->slope_of, start_, 0, 3, a, in.rate[a]);
    AddAtNodes(tables_->slope_of, their, 0, M, a, target_rate);
    for (int k = 0; k < kernels::kPaddedNodes; ++k) in.rate[a][k] -= target_rate[k];
  }
  const double scale =
      (config_.cost_max - config_.cost_min) / (config_.cost_range * config_.cost_range);
  in.weight_obstacle = config_.weight_obstacle * scale;
  in.weight_distance = config_.weight_distance;
  in.weight_yaw = config_.weight_yaw;
  in.desired_distance = config_.desired_distance;
  in.yaw_floor = kYawDistanceFloor * kYawDistanceFloor;
  in.cost_range = config_.cost_range;
}

// Obstacles that may cost anything to plans within kReach of the given one.
void Refiner::SetNear(const Points& b) {
  near_.clear();
  input_.n_near = 0;
  if (config_.weight_obstacle > 0.0) {
    Points global = b;
    global.rowwise() += origin_.transpose();
    const Box box = BoxOf(global, tables_->degree + 1, kReach);
    const auto add = [&](const Ellipsoid& e) {
      if (!MayTouch(box, e.center, e.safety, config_.cost_range)) return;
      const Eigen::Matrix3d& R = e.safety;
      for (const double r : {R(0, 0), R(0, 1), R(0, 2), R(1, 1), R(1, 2), R(2, 2)})
        near_.push_back(r);
      Eigen::Vector3d at[kernels::kPaddedNodes];
      for (int k = 0; k < kernels::kPaddedNodes; ++k)
        at[k] = (k == 0 || e.center.rows() > 1
                     ? Eigen::Vector3d(Evaluate(e.center, GaussNodes().tau[k % kNodes]) - origin_)
                     : at[0]);
      for (int a = 0; a < 3; ++a)
        for (const Eigen::Vector3d& c : at) near_.push_back(c[a]);
      ++input_.n_near;
    };
    if (problem_->reach) {
      for (const int j : problem_->near) add(problem_->obstacles[static_cast<size_t>(j)]);
    } else {
      for (const Ellipsoid& e : problem_->obstacles) add(e);
    }
  }
  input_.near = near_.data();
}

Cost Refiner::CostOf(const Free& x) const {
  const kernels::ObjectiveParts parts = kernels_.objective(input_, x.data());
  const double scale =
      (config_.cost_max - config_.cost_min) / (config_.cost_range * config_.cost_range);
  Cost cost;
  cost.j1 = config_.weight_smooth > 0.0 ? parts.smooth / config_.weight_smooth : 0.0;
  cost.j2 = scale * parts.near +
            config_.cost_min * problem_->duration * static_cast<double>(problem_->obstacles.size());
  cost.j3 = parts.distance;
  cost.j4 = parts.yaw;
  cost.total = parts.smooth + config_.weight_obstacle * cost.j2 +
               config_.weight_distance * cost.j3 + config_.weight_yaw * cost.j4;
  return cost;
}

bool Refiner::Direction(const Free& x, Free* step) const {
  kernels::ObjectiveModel model;
  kernels_.model(input_, x.data(), model);
  for (int i = 0; i < 3 * free_; ++i)
    model.hessian[i][i] += kDamping + 1e-3 * std::abs(model.hessian[i][i]);
  return SolveDownhill(3 * free_, model.hessian, model.gradient, step->data());
}

Refiner::Free Refiner::Moved(const Free& x, const Free& step, double share) const {
  Free moved = x;
  for (int f = 0; f < free_; ++f) {
    const Eigen::Vector3d from = first_.segment<3>(3 * f);
    const Eigen::Vector3d offset = x.segment<3>(3 * f) + share * step.segment<3>(3 * f) - from;
    moved.segment<3>(3 * f) = from + offset * std::min(1.0, kReach / std::max(1e-9, offset.norm()));
  }
  return moved;
}

bool Refiner::IsProven(const Free& x, Curve* plan) {
  Points b = start_;
  for (int f = 0; f < free_; ++f) b.row(4 + f) = x.segment<3>(3 * f).transpose();
  *plan = ToPower(b, tables_->degree);
  plan->topRows(4) = problem_->start;
  if (problem_->reach && !Contains(*problem_->reach, *plan)) return false;
  return KeepsLimits(*plan, *problem_) && proof_.Holds(*plan, false);
}

void Refiner::Descend(int steps, Free* x, Cost* cost) const {
  Free step;
  for (int i = 0; i < steps && Direction(*x, &step); ++i) {
    const Cost before = *cost;
    for (const double share : {1.0, 0.5, 0.25, 0.1}) {
      const Free moved = Moved(*x, step, share);
      const Cost next = CostOf(moved);
      if (!(next.total < cost->total)) continue;
      *x = moved;
      *cost = next;
      break;
    }
    if (!IsWorthIt(before, *cost)) break;
  }
}

void Refiner::SetPlan(const Curve& plan) {
  Curve local = plan;
  local.row(0) -= origin_.transpose();
  const Points b = ToPoints(local, tables_->degree);
  first_.setZero();
  for (int f = 0; f < free_; ++f) first_.segment<3>(3 * f) = b.row(4 + f).transpose();
  SetNear(b);
}

bool Refiner::Improve(int steps, Curve* plan, Cost* cost) {
  SetPlan(*plan);
  *cost = CostOf(first_);
  Free x = first_;
  Cost found = *cost;
  Descend(steps, &x, &found);
  const Free way = x - first_;
  for (const double share : {1.0, 0.6, 0.3, 0.1}) {
    if (share < 1.0) found = CostOf(x = first_ + share * way);
    Curve moved;
    if (!IsWorthIt(*cost, found)) return false;
    if (!IsProven(x, &moved)) continue;
    *plan = moved;
    *cost = found;
    return true;
  }
  return false;
}

}  // namespace chase::planning
