// The candidates of a problem and what they cost.

#include <algorithm>
#include <cmath>

#include "services/planning/fast_problem.h"

namespace chase::planning {

using kernels::kRecord;

bool FastProblem::SetCandidates() {
  const Problem& p = *problem_;
  const int M = p.degree;
  origin_ = p.target.row(0).transpose();
  Curve target = p.target, start = p.start;
  target.row(0).setZero();
  start.row(0) -= origin_.transpose();
  target_ = ToPoints(target, M);
  start_ = ToPoints(start, M);
  largest_ = 0.0;
  for (int f = 0; f < free_; ++f)
    for (int a = 0; a < 3; ++a) {
      double sum = 0.0;
      for (int i = 0; i < 4; ++i) sum += tables_->fixed(f, i) * start_(i, a);
      base_[3 * f + a] = sum;
      largest_ = std::max(largest_, std::abs(sum));
    }
  SetRecords();
  reach_ =
      std::max({start_.topRows(4).cwiseAbs().maxCoeff(), target_.cwiseAbs().maxCoeff(), largest_});
  return reach_ < 1e4;
}

// What each skeleton adds to the free points: it pulls all axes alike.
void FastProblem::SetRecords() {
  const Problem& p = *problem_;
  choices_.clear();
  size_t n_records = 0;
  for (const auto& choices : p.skeletons) n_records += choices.size();
  if (records_.size() != n_records * kRecord || record_free_ != free_)
    records_.assign(n_records * kRecord, 0.0);  // the rest of a record stays zero
  record_free_ = free_;
  double* record = records_.data();
  for (size_t n = 0; n < p.skeletons.size(); ++n) {
    choices_.push_back(static_cast<int>(p.skeletons[n].size()));
    double pull[3] = {}, whitened[3] = {}, strongest = 0.0, farthest = 0.0;
    for (int f = 0; f < free_; ++f) {
      pull[f] = tables_->pull(f, static_cast<Eigen::Index>(n));
      strongest = std::max(strongest, std::abs(pull[f]));
    }
    for (int f = 0; f < free_; ++f)
      for (int g = f; g < free_; ++g) whitened[f] += tables_->root(f, g) * pull[g];
    for (const Eigen::Vector3d& u : p.skeletons[n]) {
      const Eigen::Vector3d r = u - origin_;
      for (int a = 0; a < 3; ++a) {
        farthest = std::max(farthest, std::abs(r[a]));
        for (int f = 0; f < free_; ++f) {
          record[3 * f + a] = pull[f] * r[a];
          record[kernels::kWhitened + 3 * f + a] = whitened[f] * r[a];
        }
      }
      record += kRecord;
    }
    largest_ += strongest * farthest;
  }
}

// Ranges of the free points.
void FastProblem::SetRanges() {
  const int nx = 3 * free_;
  std::copy(base_, base_ + nx, low_);
  std::copy(base_, base_ + nx, high_);
  const double* record = records_.data();
  for (const int choices : choices_) {
    double low[9], high[9];
    std::fill(low, low + 9, HUGE_VAL);
    std::fill(high, high + 9, -HUGE_VAL);
    for (int s = 0; s < choices; ++s, record += kRecord)
      for (int k = 0; k < nx; ++k) {
        low[k] = std::min(low[k], record[k]);
        high[k] = std::max(high[k], record[k]);
      }
    for (int k = 0; k < nx; ++k) {
      low_[k] += low[k];
      high_[k] += high[k];
    }
  }
}

// The whitened part of `n` records from `from` on, side by side.
void FastProblem::SetWhitened(int from, int n, int nx, std::vector<float>* columns) const {
  const int row = Padded(n);
  columns->assign(static_cast<size_t>(nx * row), 0.0f);
  for (int s = 0; s < n; ++s)
    for (int k = 0; k < nx; ++k)
      (*columns)[static_cast<size_t>(k * row + s)] = static_cast<float>(
          records_[static_cast<size_t>((from + s) * kRecord + kernels::kWhitened + k)]);
}

void FastProblem::Generate(float limit) {
  const int nx = 3 * free_, first = choices_[0];
  kernels::CandidateInput in{};
  std::copy(base_, base_ + nx, in.base);
  double offset = 0.0;
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector4d b = start_.col(a).head<4>();
    const Eigen::Vector3d best = tables_->best * b;
    offset += b.dot(tables_->rest * b);
    for (int f = 0; f < free_; ++f) {
      double& whitened = in.base[kernels::kWhitened + 3 * f + a];
      for (int g = f; g < free_; ++g)
        whitened += tables_->root(f, g) * (base_[3 * g + a] - best[g]);
    }
  }
  in.j1_offset = static_cast<float>(std::max(0.0, offset));
  SetWhitened(0, first, nx, &first_whitened_);
  in.first_whitened = first_whitened_.data();
  in.first_row = Padded(first);
  first_.resize(static_cast<size_t>(first * kernels::kWhitened));
  for (int s = 0; s < first; ++s)
    std::copy_n(&records_[static_cast<size_t>(s * kRecord)], kernels::kWhitened,
                &first_[static_cast<size_t>(s * kernels::kWhitened)]);
  in.longest2 = HUGE_VALF;
  if (choices_.size() > 1) {
    SetWhitened(first, choices_[1], nx, &second_whitened_);
    in.second_whitened = second_whitened_.data();
    in.second_row = Padded(choices_[1]);
  }
  if (limit < HUGE_VALF) {
    double farthest2 = 0.0;
    for (int s = 0; s < first; ++s)
      for (int k = 0; k < nx; ++k)
        in.first_middle[k] += records_[static_cast<size_t>(s) * kRecord + kernels::kWhitened +
                                       static_cast<size_t>(k)] /
                              first;
    for (int s = 0; s < first; ++s) {
      double length2 = 0.0;
      for (int k = 0; k < nx; ++k) {
        const double e = records_[static_cast<size_t>(s) * kRecord + kernels::kWhitened +
                                  static_cast<size_t>(k)] -
                         in.first_middle[k];
        length2 += e * e;
      }
      farthest2 = std::max(farthest2, length2);
    }
    // By the triangle inequality; the rest is above what single precision rounds.
    const double most = std::sqrt(farthest2) + std::sqrt(std::max(0.0, limit - offset));
    in.longest2 = static_cast<float>(1.002 * most * most + 1e-3);
  }
  prefix_.resize(static_cast<size_t>(n_ / first) * kRecord);
  in.records = records_.data();
  in.choices = choices_.data();
  in.steps = static_cast<int>(choices_.size());
  kernels::Context& c = context_;
  c.prefix = prefix_.data();
  c.first = first_.data();
  c.choices = first;
  c.inverse =
      ((uint64_t{1} << 32) + static_cast<uint64_t>(first) - 1) / static_cast<uint64_t>(first);
  kernels_.generate(c, in);
}

void FastProblem::SetNodes() {
  kernels::Context& c = context_;
  const double T = problem_->duration;
  for (int k = 0; k < kNodes; ++k) {
    for (int f = 0; f < free_; ++f) {
      c.phi[k][f] = static_cast<float>(tables_->phi[k][4 + f]);
      c.slope[k][f] = static_cast<float>(tables_->slope[k][4 + f]);
    }
    c.nodes[k] = k;
    c.weight3[k] = static_cast<float>(config_.weight_distance * T * GaussNodes().weight[k]);
    c.weight4[k] = static_cast<float>(config_.weight_yaw * T * GaussNodes().weight[k]);
  }
  constexpr int kPadded = CandidateTables::kPadded;
  const int M = problem_->degree;
  for (int a = 0; a < 3; ++a) {
    double p[kPadded] = {}, q[kPadded] = {}, v[kPadded] = {}, w[kPadded] = {};
    AddAtNodes(tables_->phi_of, start_, 0, 3, a, p);
    AddAtNodes(tables_->phi_of, target_, 0, M, a, q);
    if (a < 2) {
      AddAtNodes(tables_->slope_of, start_, 0, 3, a, v);
      AddAtNodes(tables_->slope_of, target_, 0, M, a, w);
    }
    for (int k = 0; k < kNodes; ++k) {
      c.rel[k][a] = static_cast<float>(p[k] - q[k]);
      c.target[k][a] = static_cast<float>(q[k]);
      if (a < 2) c.rel_rate[k][a] = static_cast<float>(v[k] - w[k]);
    }
  }
}

Points FastProblem::PointsOf(int index) const {
  double z[9];
  const int nx = 3 * free_;
  std::copy(base_, base_ + nx, z);
  size_t at = 0;
  for (int choices : choices_) {
    const double* record = &records_[(at + static_cast<size_t>(index % choices)) * kRecord];
    for (int k = 0; k < nx; ++k) z[k] += record[k];
    index /= choices;
    at += static_cast<size_t>(choices);
  }
  Points b = start_;
  for (int f = 0; f < free_; ++f)
    for (int a = 0; a < 3; ++a) b(4 + f, a) = z[3 * f + a];
  return b;
}

Curve FastProblem::PlanOf(int index) const {
  Curve plan = ToPower(PointsOf(index), problem_->degree);
  plan.topRows(4) = problem_->start;
  return plan;
}

// J2 above its constant part, at one node, p local.
double FastProblem::ObstacleCost(int node, const double* p) const {
  const double tau = GaussNodes().tau[node];
  double sum = 0.0;
  for (int e = near_begin_[node]; e < near_begin_[node + 1]; ++e) {
    const int row = near_[static_cast<size_t>(e)].row;
    const Ellipsoid& o =
        problem_->obstacles[static_cast<size_t>(obstacle_of_[static_cast<size_t>(row)])];
    double d[3];
    for (int a = 0; a < 3; ++a) {
      double c = 0.0;
      for (Eigen::Index k = o.center.rows() - 1; k > 0; --k) c = (c + o.center(k, a)) * tau;
      d[a] = p[a] - (c + (o.center(0, a) - origin_[a]));
    }
    const Eigen::Matrix3d& R = o.safety;
    const double s = d[0] * (R(0, 0) * d[0] + R(0, 1) * d[1] + R(0, 2) * d[2]) +
                     d[1] * (R(1, 0) * d[0] + R(1, 1) * d[1] + R(1, 2) * d[2]) +
                     d[2] * (R(2, 0) * d[0] + R(2, 1) * d[1] + R(2, 2) * d[2]);
    if (s >= config_.cost_range * config_.cost_range) continue;
    const double l = std::sqrt(s) - config_.cost_range;
    sum += l * l;
  }
  return sum;
}

Cost FastProblem::CostOf(int index) const {
  const int M = problem_->degree;
  const double T = problem_->duration;
  const Points b = PointsOf(index);
  double r[7][3];
  for (int i = 0; i <= M; ++i)
    for (int a = 0; a < 3; ++a) r[i][a] = target_(i, a) - b(i, a);
  Cost cost;
  double j1 = 0.0, near = 0.0;
  for (int i = 0; i <= M; ++i) {
    j1 += tables_->smooth(i, i) * b.row(i).squaredNorm();
    for (int j = i + 1; j <= M; ++j) j1 += 2.0 * tables_->smooth(i, j) * b.row(i).dot(b.row(j));
  }
  for (int k = 0; k < kNodes; ++k) {
    const double weight = T * GaussNodes().weight[k];
    double d[3] = {}, v[2] = {};
    for (int i = 0; i <= M; ++i) {
      for (int a = 0; a < 3; ++a) d[a] += tables_->phi[k][i] * r[i][a];
      for (int a = 0; a < 2; ++a) v[a] += tables_->slope[k][i] * r[i][a];
    }
    const double h = d[0] * d[0] + d[1] * d[1];
    const double excess = std::sqrt(h + d[2] * d[2]) - config_.desired_distance;
    const double rate =
        (d[0] * v[1] - d[1] * v[0]) / std::max(h, kYawDistanceFloor * kYawDistanceFloor);
    const double rise = config_.desired_height() + d[2];
    cost.j3 += weight * (excess * excess + config_.rho_height * rise * rise);
    cost.j4 += weight * rate * rate;
    if (near_begin_[k] == near_begin_[k + 1]) continue;
    double p[3] = {};
    for (int i = 0; i <= M; ++i)
      for (int a = 0; a < 3; ++a) p[a] += tables_->phi[k][i] * b(i, a);
    near += weight * ObstacleCost(k, p);
  }
  const double scale =
      (config_.cost_max - config_.cost_min) / (config_.cost_range * config_.cost_range);
  cost.j1 = config_.weight_smooth > 0.0 ? j1 / config_.weight_smooth : 0.0;
  cost.j2 = scale * near + config_.cost_min * T * static_cast<double>(problem_->obstacles.size());
  cost.total = j1 + config_.weight_obstacle * cost.j2 + config_.weight_distance * cost.j3 +
               config_.weight_yaw * cost.j4;
  return cost;
}

}  // namespace chase::planning
