#include "services/planning/refinement.h"

#include <algorithm>
#include <cmath>

#include "services/planning/limits.h"

namespace chase::planning {
namespace {

constexpr double kLeast = 2e-4;       // relative gain of a step that is worth another
constexpr double kRepairReach = 2.0;  // m, instead of kReach
constexpr double kDamping = 1e-6;

bool IsWorthIt(const Cost& before, const Cost& after) {
  return before.total - after.total >= kLeast * before.total;
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
  WithRoom(problem, config_.exact_visibility ? config_.refine_room : 0.0, &enlargements_, &roomy_);
  proof_.Reset(roomy_, sight_from, config_.exact_visibility);
  return true;
}

void Refiner::SetObjective() {
  const int M = tables_->degree;
  Curve start = problem_->start, target = problem_->target;
  start.row(0) -= origin_.transpose();
  target.row(0).setZero();
  start_ = ToPoints(start, M);
  target_ = ToPoints(target, M);
  cuts_ready_ = false;
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
    AddAtNodes(tables_->phi_of, target_, 0, M, a, target_at);
    for (int k = 0; k < kernels::kPaddedNodes; ++k)
      in.rel[a][k] = k < kNodes ? in.at[a][k] - target_at[k] : 1.0;  // anything but zero
    if (a == 2) continue;
    std::fill(in.rate[a], in.rate[a] + kernels::kPaddedNodes, 0.0);
    AddAtNodes(tables_->slope_of, start_, 0, 3, a, in.rate[a]);
    AddAtNodes(tables_->slope_of, target_, 0, M, a, target_rate);
    for (int k = 0; k < kernels::kPaddedNodes; ++k) in.rate[a][k] -= target_rate[k];
  }
  const double scale =
      (config_.cost_max - config_.cost_min) / (config_.cost_range * config_.cost_range);
  in.weight_obstacle = config_.weight_obstacle * scale;
  in.weight_distance = config_.weight_distance;
  in.weight_yaw = config_.weight_yaw;
  in.desired_distance = config_.desired_distance;
  in.desired_height = config_.desired_height();
  in.rho_height = config_.rho_height;
  in.yaw_floor = kYawDistanceFloor * kYawDistanceFloor;
  in.cost_range = config_.cost_range;
}

// Obstacles that may cost anything to plans within reach_ of the given one.
void Refiner::SetNear(const Points& b) {
  near_.clear();
  input_.n_near = 0;
  if (config_.weight_obstacle > 0.0) {
    Points global = b;
    global.rowwise() += origin_.transpose();
    const Box box = BoxOf(global, tables_->degree + 1, reach_);
    const auto add = [&](const Ellipsoid& e) {
      if (!MayTouch(box, e.center, e.safety_half, config_.cost_range)) return;
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

bool Refiner::MakeModel(const Free& x, Model* model) const {
  const int n = 3 * free_;
  kernels::ObjectiveModel m;
  kernels_.model(input_, x.data(), m);
  auto& L = model->L;
  for (int i = 0; i < n; ++i) {
    double y = -m.gradient[i];
    for (int j = 0; j <= i; ++j) {
      double sum = m.hessian[i][j];
      if (i == j) sum += kDamping + 1e-3 * std::abs(sum);
      for (int k = 0; k < j; ++k) sum -= L[i][k] * L[j][k];
      if (j < i) {
        L[i][j] = sum * model->inverse[j];
      } else {
        if (!(sum > 0.0)) return false;
        L[i][i] = std::sqrt(sum);
        model->inverse[i] = 1.0 / L[i][i];
      }
    }
    for (int k = 0; k < i; ++k) y -= L[i][k] * model->y[k];
    model->y[i] = y * model->inverse[i];
  }
  return true;
}

Refiner::Free Refiner::StepOf(const Model& model) const {
  const int n = 3 * free_;
  Free x = Free::Zero();
  for (int i = n - 1; i >= 0; --i) {
    x[i] = model.y[i];
    for (int k = i + 1; k < n; ++k) x[i] -= model.L[k][i] * x[k];
    x[i] *= model.inverse[i];
  }
  return x;
}

Refiner::Free Refiner::Moved(const Free& x, const Free& step, double share) const {
  Free moved = x;
  for (int f = 0; f < free_; ++f) {
    const Eigen::Vector3d from = first_.segment<3>(3 * f);
    const Eigen::Vector3d offset = x.segment<3>(3 * f) + share * step.segment<3>(3 * f) - from;
    moved.segment<3>(3 * f) = from + offset * std::min(1.0, reach_ / std::max(1e-9, offset.norm()));
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

void Refiner::Descend(int steps, Free* x, Cost* cost) {
  for (int i = 0; i < steps; ++i) {
    Model here;
    Model* model = i == 0 ? &model_ : &here;
    const bool is_convex = MakeModel(*x, model);
    if (i == 0) has_model_ = is_convex;
    if (!is_convex) return;
    const Free step = StepOf(*model);
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

bool Refiner::GoAround(const Free& x, double limit, Curve* plan, Cost* cost) {
  constexpr int kRounds = 3;
  if (!has_model_ || !proof_.IsUsable() || !proof_.IsLinear()) return false;
  if (!cuts_ready_) cuts_.Reset(*tables_, proof_, start_, target_);
  cuts_ready_ = true;
  cuts_.Clear();
  Free at = x;
  for (int round = 0; round < kRounds; ++round) {
    if (cuts_.Add(at.data(), round == 0 ? first_.data() : at.data()) == 0) return false;
    Model model = model_;
    cuts_.Project(model.L, model.inverse, first_.data(), model.y);
    at = Moved(first_, StepOf(model), 1.0);
    const Cost there = CostOf(at);
    if (!(there.total < limit)) return false;
    Curve moved;
    if (!IsProven(at, &moved)) continue;
    *plan = moved;
    *cost = there;
    return true;
  }
  return false;
}

bool Refiner::Improve(int steps, Curve* plan, Cost* cost) {
  reach_ = kReach;
  SetPlan(*plan);
  *cost = CostOf(first_);
  Free x = first_;
  Cost found = *cost;
  Descend(steps, &x, &found);
  if (!IsWorthIt(*cost, found)) return false;
  Curve moved;
  if (IsProven(x, &moved)) {
    *plan = moved;
    *cost = found;
    return true;
  }
  if (KeepsLimits(moved, *problem_)) return GoAround(x, (1.0 - kLeast) * cost->total, plan, cost);
  // Nothing leads around a limit: part of the way may keep it.
  found = CostOf(x = first_ + 0.4 * (x - first_));
  if (!IsWorthIt(*cost, found) || !IsProven(x, &moved)) return false;
  *plan = moved;
  *cost = found;
  return true;
}

bool Refiner::Repair(Curve* plan, Cost* cost) {
  reach_ = kRepairReach;
  SetPlan(*plan);
  has_model_ = MakeModel(first_, &model_);
  if (!has_model_) return false;
  const Free x = Moved(first_, StepOf(model_), 1.0);
  Curve moved;
  if (!IsProven(x, &moved)) return GoAround(x, HUGE_VAL, plan, cost);
  *plan = moved;
  *cost = CostOf(x);
  return true;
}

}  // namespace chase::planning
