#include "services/planning/fast_problem.h"

#include <algorithm>
#include <cmath>

namespace chase::planning {

using kernels::kPad;
using kernels::kRecord;

int FastProblem::Padded(int n) { return (n + kPad - 1) / kPad * kPad; }

bool FastProblem::Set(const Problem& problem, PlanProof* proof, float limit) {
  problem_ = &problem;
  proof_ = proof;
  beyond_ = false;
  has_obstacles_ = has_costs_ = false;
  const int M = problem.degree;
  if (problem.target.rows() > M + 1 || problem.skeletons.empty() || problem.skeletons.size() > 8 ||
      problem.n_candidates() < 1)
    return false;
  for (const Ellipsoid& e : problem.obstacles)
    if (e.center.rows() > M + 1) return false;
  n_ = problem.n_candidates();
  free_ = M - 3;
  const int steps = static_cast<int>(problem.skeletons.size());
  tables_ = &shelf_.Get(M, steps, problem.duration);
  if (!SetCandidates()) return false;
  kernels::Context& c = context_;
  c.degree = M;
  c.n_candidates = n_;
  c.stride = Padded(n_) + 4 * kPad;
  j1_.resize(static_cast<size_t>(c.stride));
  c.j1 = j1_.data();
  work_.resize(static_cast<size_t>(3 * free_ * c.stride));
  alive_.resize(j1_.size() / 8);
  c.work = work_.data();
  c.alive = alive_.data();
  c.desired_distance = static_cast<float>(config_.desired_distance);
  c.desired_height = static_cast<float>(config_.desired_height());
  c.rho_height = static_cast<float>(config_.rho_height);
  c.yaw_floor = static_cast<float>(kYawDistanceFloor * kYawDistanceFloor);
  c.cost_range = static_cast<float>(config_.cost_range);
  c.exact = config_.exact_visibility ? 1 : 0;
  Generate(limit);
  return true;
}

bool FastProblem::SetObstacles() {
  if (!proof_->IsUsable()) {
    beyond_ = true;
    return false;
  }
  if (!has_obstacles_) SetShapes(*proof_);
  has_obstacles_ = true;
  return !blocked_;
}

void FastProblem::SetShapeInput(const PlanProof& proof, kernels::ShapeInput* in) {
  const int M = problem_->degree;
  in->degree = M;
  in->n = proof.padded();
  in->R = proof.shapes();
  in->center = centers_.data();
  in->rows = rows_.data();
  in->cost_range = static_cast<float>(config_.cost_range);
  in->exact = config_.exact_visibility;
  in->reach = static_cast<float>(reach_ * 1.0001);
  for (int a = 0; a < 3; ++a) {
    for (int i = 0; i <= M; ++i) in->target[i][a] = static_cast<float>(target_(i, a));
    for (int i = 0; i < 4; ++i) in->fixed[i][a] = static_cast<float>(start_(i, a));
    for (int f = 0; f < free_; ++f) {
      in->mid[f][a] = static_cast<float>(0.5 * (low_[3 * f + a] + high_[3 * f + a]));
      in->half[f][a] = static_cast<float>(0.5 * (high_[3 * f + a] - low_[3 * f + a]) * (1 + 1e-6) +
                                          1e-6 * reach_ + 1e-6);
    }
  }
  const double weight = config_.weight_obstacle * problem_->duration *
                        (config_.cost_max - config_.cost_min) /
                        (config_.cost_range * config_.cost_range);
  for (int k = 0; k < kNodes; ++k) {
    in->node_tau[k] = static_cast<float>(GaussNodes().tau[k]);
    in->node_weight[k] = static_cast<float>(weight * GaussNodes().weight[k]);
    for (int a = 0; a < 3; ++a) {
      double mid = 0.0, half = 0.0;
      for (int i = 0; i < 4; ++i) mid += tables_->phi[k][i] * start_(i, a);
      for (int f = 0; f < free_; ++f) {
        mid += tables_->phi[k][4 + f] * 0.5 * (low_[3 * f + a] + high_[3 * f + a]);
        half += tables_->phi[k][4 + f] * 0.5 * (high_[3 * f + a] - low_[3 * f + a]);
      }
      in->node_mid[k][a] = static_cast<float>(mid);
      in->node_half[k][a] = static_cast<float>(half + 1e-5);
    }
  }
}

void FastProblem::SetShapes(const PlanProof& proof) {
  SetRanges();
  const Problem& p = *problem_;
  const int columns = proof.padded();
  const auto n = static_cast<size_t>(columns);
  n_shapes_ = static_cast<int>(proof.rows().size());
  Eigen::Index center_rows = 1;
  for (const Ellipsoid& e : p.obstacles) center_rows = std::max(center_rows, e.center.rows());
  rows_.resize(n);
  obstacle_of_.resize(n);
  centers_.assign(static_cast<size_t>(3 * center_rows) * n, 0.0f);
  for (int column = 0; column < columns && n_shapes_ > 0; ++column) {
    const bool real = column < n_shapes_;
    const PlanProof::Row& row = proof.rows()[static_cast<size_t>(std::min(column, n_shapes_ - 1))];
    const auto at = static_cast<size_t>(column);
    rows_[at] = {static_cast<float>(row.from), real && row.safety, real && row.sight};
    obstacle_of_[at] = row.obstacle;
    const Curve& c = p.obstacles[static_cast<size_t>(row.obstacle)].center;
    for (Eigen::Index k = 0; k < c.rows(); ++k)
      for (int a = 0; a < 3; ++a)
        centers_[static_cast<size_t>(3 * k + a) * n + at] =
            static_cast<float>(k == 0 ? c(0, a) - origin_[a] : c(k, a));
  }
  tables_of_shapes_.resize(static_cast<size_t>(kernels::kTableSize) * n);
  factors_.resize(6 * n);
  low_plan_.resize(n);
  low_target_.resize(n);
  low_sight_.resize(n);
  margin_.resize(n);
  near_.resize(static_cast<size_t>(kNodes) * n);
  if (shadows_.size() < n) shadows_.resize(n);
  if (n_shapes_ > 0) {
    kernels::ShapeInput in;
    in.center_rows = static_cast<int>(center_rows);
    SetShapeInput(proof, &in);
    kernels::ShapeOutput out;
    out.tables = tables_of_shapes_.data();
    out.L = factors_.data();
    out.low_plan = low_plan_.data();
    out.low_target = low_target_.data();
    out.low_sight = low_sight_.data();
    out.margin = margin_.data();
    out.near = near_.data();
    kernels_.shape(in, out);
    std::copy(out.near_begin, out.near_begin + kNodes + 1, near_begin_);
  } else {
    std::fill(near_begin_, near_begin_ + kNodes + 1, 0);
  }
  SetOrder(proof);
  context_.near = near_.data();
  context_.near_begin = near_begin_;
  context_.rows = rows_.data();
  context_.tables = tables_of_shapes_.data();
  context_.margin = margin_.data();
  context_.shadows = shadows_.data();
}

// Rows that no plane settles for all candidates, the nearest to the plans first.
void FastProblem::SetOrder(const PlanProof& proof) {
  order_.clear();
  blocked_ = false;
  for (int r = 0; r < n_shapes_; ++r) {
    const auto at = static_cast<size_t>(r);
    const bool asks_sight = rows_[at].asks_sight;
    if (low_plan_[at] > 1.0f && (!asks_sight || low_sight_[at] > 1.0f)) continue;
    order_.push_back(r);
    shadows_[at].ready = 0;
    blocked_ = blocked_ || (asks_sight && !(low_target_[at] > 1.0f) && !proof.TargetIsOutside(r));
  }
  std::sort(order_.begin(), order_.end(), [this](int a, int b) {
    const float x = low_plan_[static_cast<size_t>(a)], y = low_plan_[static_cast<size_t>(b)];
    return x != y ? x < y : a < b;
  });
  context_.order = order_.data();
  context_.n_rows = static_cast<int>(order_.size());
}

void FastProblem::AliveGroups(std::vector<int>* groups) {
  const int nx = 3 * free_, first = choices_[0], n = n_ / first;
  float mid[9], half[9];
  for (int k = 0; k < nx; ++k) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int s = 0; s < first; ++s) {
      low = std::min(low, records_[static_cast<size_t>(s) * kRecord + static_cast<size_t>(k)]);
      high = std::max(high, records_[static_cast<size_t>(s) * kRecord + static_cast<size_t>(k)]);
    }
    mid[k] = static_cast<float>(0.5 * (low + high));
    half[k] = static_cast<float>(0.5 * (high - low) * (1 + 1e-5) + 1e-6);
  }
  const int columns = static_cast<int>(low_plan_.size());
  slack_.resize(low_plan_.size());
  for (const int r : order_) {
    float L[6], largest = 0.0f;
    for (int i = 0; i < 6; ++i) L[i] = std::abs(factors_[static_cast<size_t>(i * columns + r)]);
    for (int f = 0; f < free_; ++f) {
      const float* h = half + 3 * f;
      const float z[3] = {L[0] * h[0] + L[1] * h[1] + L[2] * h[2], L[3] * h[1] + L[4] * h[2],
                          L[5] * h[2]};
      largest = std::max(largest, z[0] * z[0] + z[1] * z[1] + z[2] * z[2]);
    }
    slack_[static_cast<size_t>(r)] = std::min(1.0f, 1.0001f * std::sqrt(largest));
  }
  groups->resize(static_cast<size_t>(n + kPad));
  states_.resize(static_cast<size_t>(n + kPad));
  context_.slack = slack_.data();
  groups->resize(
      static_cast<size_t>(kernels_.check_groups(context_, mid, n, groups->data(), states_.data())));
  context_.slack = nullptr;
  std::sort(groups->begin(), groups->end());
}

}  // namespace chase::planning
