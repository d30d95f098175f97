#include "services/planning/fast_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "services/planning/candidate_set.h"
#include "services/planning/fast_kernels.h"
#include "services/planning/product_weights.h"
#include "services/planning/reference_search.h"

namespace chase::planning {
namespace {

using kernels::Entry;
using kernels::kLanes;
using kernels::NearNode;

constexpr double kCullMargin = 2e-3;  // above all rounding of the culling in single precision
constexpr float kSlack = 1e-4f;       // relative: costs in single precision are that good
constexpr int kBatch = 16;

int Padded(int n) { return (n + kLanes - 1) / kLanes * kLanes; }

/// A shape of one obstacle that has to be tested.
struct Task {
  int obstacle;
  bool safety, sight;
  double from;
};

struct Near {
  double weight;
  int obstacle;
};

class FastSearch : public Search {
 public:
  FastSearch(const PlannerConfig& config, const kernels::Table& table)
      : config_(config),
        kernels_(table),
        fallback_(MakeReferenceSearch(config, Arithmetic::kCertified)) {}

  Found Best(const Problem& problem, double sight_from) override {
    if (!Prepare(problem, sight_from)) return fallback_->Best(problem, sight_from);
    Found found;
    found.generated = n_;
    checked_ = feasible_ = 0;
    winner_ = -1;
    excluded_.clear();
    if (!blocked_) {
      Run();
      // The winner stands on single-precision tests until it is proven; the next best follows when
      // that fails.
      while (winner_ >= 0 && !Proven(winner_)) {
        excluded_.push_back(winner_);
        Run();
      }
    }
    found.checked = checked_;
    found.feasible = feasible_;
    if (winner_ < 0) return found;
    found.index = winner_;
    found.plan = PlanOf(PointsOf(winner_));
    found.cost = CostOf(PointsOf(winner_));
    return found;
  }

 private:
  // ---- preparation
  bool Prepare(const Problem& problem, double sight_from);
  bool PrepareCandidates();
  bool PrepareObstacles();
  void PrepareNodes();
  void FillEntry(const Task& task, const float* normal, Entry* e);
  void PrepareContext();

  // ---- candidates in double
  Points PointsOf(int index) const;
  Curve PlanOf(const Points& b) const;
  Cost CostOf(const Points& b) const;
  bool KeepsLimitsQuickly(const Points& b) const;
  bool Proven(int index);

  // ---- search
  void Run();
  void Weigh(std::vector<int>* ids, float limit);
  void Drain(int max_batches);
  void Batch(int* ids, float* lower, int n);
  void CheckAll();
  void Accept(int id, float cost);
  float Limit() const { return best_ * (1.0f + kSlack); }

  PlannerConfig config_;
  const kernels::Table& kernels_;
  std::unique_ptr<Search> fallback_;
  const Problem* problem_ = nullptr;
  double sight_from_ = 0.0;
  CandidateTables tables_;
  kernels::Context context_{};

  int n_ = 0, free_ = 0;
  Eigen::Vector3d origin_;
  Points start_, target_;                   // local control points
  std::vector<double> pulls_;               // [step][choice][3 free]: pull of each skeleton
  std::vector<int> choices_;                // per step
  double base_[9];                          // free points without skeletons
  Eigen::Matrix<double, 3, 3> low_, high_;  // of the free points, rows f
  double reach_ = 0.0;                      // largest local coordinate
  bool blocked_ = false;

  std::vector<float> columns_, cull_;  // of Cull
  std::vector<uint32_t> near_;
  std::vector<Eigen::Matrix3d> safety_L_;
  std::vector<Entry> entries_;
  std::vector<Task> tasks_;
  std::vector<int> order_;
  std::vector<NearNode> near_nodes_;
  std::vector<Near> near_double_;
  std::vector<float> x_, j1_, prefix_, first_;
  double node_centers_ = 0.0;

  std::vector<int> ids_, rest_, batch_ids_;
  std::vector<float> values_;
  std::vector<uint8_t> states_;
  std::vector<std::pair<float, int>> heap_;
  std::vector<int> excluded_;
  int checked_ = 0, feasible_ = 0, winner_ = -1;
  float best_ = 0.0f;
  std::vector<std::pair<float, int>> close_;  // accepted, near the best cost
};

// Candidates in local, normalised, Bernstein form; false where the fast path does not apply.
bool FastSearch::Prepare(const Problem& problem, double sight_from) {
  problem_ = &problem;
  sight_from_ = sight_from;
  const int M = problem.degree;
  if (problem.target.rows() > M + 1 || problem.skeletons.empty() || problem.skeletons.size() > 8 ||
      problem.n_candidates() < 1)
    return false;
  for (const Ellipsoid& e : problem.obstacles)
    if (e.center.rows() > M + 1) return false;
  n_ = problem.n_candidates();
  free_ = M - 3;
  const int steps = static_cast<int>(problem.skeletons.size());
  if (tables_.degree != M || tables_.steps != steps || tables_.duration != problem.duration)
    tables_ = CandidateTables(config_, M, steps, problem.duration);
  return PrepareCandidates() && PrepareObstacles();
}

bool FastSearch::PrepareCandidates() {
  const Problem& p = *problem_;
  const int M = p.degree;
  origin_ = p.target.row(0).transpose();
  Curve target = p.target, start = p.start;
  target.row(0).setZero();
  start.row(0) -= origin_.transpose();
  target_ = ToPoints(target, M);
  start_ = ToPoints(start, M);  // rows 0..3 count
  for (int f = 0; f < free_; ++f)
    for (int a = 0; a < 3; ++a) {
      double sum = 0.0;
      for (int i = 0; i < 4; ++i) sum += tables_.fixed(f, i) * start_(i, a);
      base_[3 * f + a] = low_(f, a) = high_(f, a) = sum;
    }
  choices_.clear();
  pulls_.clear();
  for (size_t n = 0; n < p.skeletons.size(); ++n) {
    choices_.push_back(static_cast<int>(p.skeletons[n].size()));
    Eigen::Matrix<double, 3, 3> low, high;
    low.setConstant(HUGE_VAL);
    high.setConstant(-HUGE_VAL);
    for (const Eigen::Vector3d& u : p.skeletons[n])
      for (int f = 0; f < free_; ++f)
        for (int a = 0; a < 3; ++a) {
          const double pull = tables_.pull(f, static_cast<int>(n)) * (u[a] - origin_[a]);
          pulls_.push_back(pull);
          low(f, a) = std::min(low(f, a), pull);
          high(f, a) = std::max(high(f, a), pull);
        }
    low_.topRows(free_) += low.topRows(free_);
    high_.topRows(free_) += high.topRows(free_);
  }
  reach_ = std::max({start_.topRows(4).cwiseAbs().maxCoeff(), target_.cwiseAbs().maxCoeff(),
                     low_.topRows(free_).cwiseAbs().maxCoeff(),
                     high_.topRows(free_).cwiseAbs().maxCoeff()});
  return reach_ < 1e4;
}

bool FastSearch::PrepareObstacles() {
  const Problem& p = *problem_;
  const int M = p.degree, n = static_cast<int>(p.obstacles.size());
  // One row of columns per shape: the safety shape, and the sight shape where it differs.
  tasks_.clear();
  for (int j = 0; j < n; ++j) {
    const Ellipsoid& e = p.obstacles[static_cast<size_t>(j)];
    const double from = std::max(sight_from_, e.sight_from);
    const bool sight = from < 1.0;
    const bool fused = sight && from == e.safety_from && e.safety == e.sight;
    tasks_.push_back({j, true, fused, e.safety_from});
    if (sight && !fused) tasks_.push_back({j, false, true, from});
  }
  const int rows = static_cast<int>(tasks_.size()), padded = Padded(std::max(1, rows));
  const int row_count = 6 + 3 * (M + 1);
  columns_.assign(static_cast<size_t>(row_count * padded), 0.0f);
  cull_.assign(static_cast<size_t>(6 * padded), 0.0f);
  near_.assign(static_cast<size_t>(padded), 0u);
  safety_L_.resize(static_cast<size_t>(rows));
  for (int r = 0; r < padded; ++r) {
    const int task = std::min(r, rows - 1);
    if (task < 0) break;
    const Task& t = tasks_[static_cast<size_t>(task)];
    const Ellipsoid& e = p.obstacles[static_cast<size_t>(t.obstacle)];
    const Eigen::LLT<Eigen::Matrix3d> llt(t.safety ? e.safety : e.sight);
    if (llt.info() != Eigen::Success) return false;
    const Eigen::Matrix3d L = llt.matrixL();
    safety_L_[static_cast<size_t>(task)] = L;
    const double values[6] = {L(0, 0), L(1, 0), L(2, 0), L(1, 1), L(2, 1), L(2, 2)};
    for (int i = 0; i < 6; ++i) columns_[static_cast<size_t>(i * padded + r)] = (float)values[i];
    Curve center = e.center;
    center.row(0) -= origin_.transpose();
    const Points o = ToPoints(center, M);
    for (int i = 0; i <= M; ++i)
      for (int a = 0; a < 3; ++a)
        columns_[static_cast<size_t>((6 + 3 * i + a) * padded + r)] = (float)o(i, a);
  }
  kernels::CullInput in{};
  in.degree = M;
  in.n = padded;
  in.L = columns_.data();
  in.o = columns_.data() + 6 * padded;
  in.cost_range = static_cast<float>(config_.cost_range);
  for (int i = 0; i <= M; ++i)
    for (int a = 0; a < 3; ++a) {
      in.target[i][a] = static_cast<float>(target_(i, a));
      if (i < 4) in.fixed[i][a] = static_cast<float>(start_(i, a));
    }
  for (int f = 0; f < free_; ++f)
    for (int a = 0; a < 3; ++a) {
      in.mid[f][a] = static_cast<float>(0.5 * (low_(f, a) + high_(f, a)));
      in.half[f][a] = static_cast<float>(0.5 * (high_(f, a) - low_(f, a)) * (1 + 1e-6) + 1e-5);
    }
  for (int k = 0; k < kNodes; ++k) {
    in.node_tau[k] = static_cast<float>(GaussNodes().tau[k]);
    for (int a = 0; a < 3; ++a) {
      double mid = 0.0, half = 0.0;
      for (int i = 0; i < 4; ++i) mid += tables_.phi[k][i] * start_(i, a);
      for (int f = 0; f < free_; ++f) {
        mid += tables_.phi[k][4 + f] * 0.5 * (low_(f, a) + high_(f, a));
        half += tables_.phi[k][4 + f] * 0.5 * (high_(f, a) - low_(f, a));
      }
      in.node_mid[k][a] = static_cast<float>(mid);
      in.node_half[k][a] = static_cast<float>(half + 1e-5);
    }
  }
  kernels::CullOutput out{cull_.data(), cull_.data() + padded, cull_.data() + 2 * padded,
                          cull_.data() + 3 * padded, near_.data()};
  if (rows > 0) kernels_.cull(in, out);

  entries_.clear();
  blocked_ = false;
  std::vector<Task> active;
  for (int r = 0; r < rows; ++r) {
    const Task& t = tasks_[static_cast<size_t>(r)];
    const bool plan_clear = out.low_plan[r] > 1.0f + kCullMargin;
    const bool target_clear = out.low_target[r] > 1.0f + kCullMargin;
    if (plan_clear && (!t.sight || target_clear)) continue;
    entries_.emplace_back();
    active.push_back(t);
    const float normal[3] = {out.normal[r], out.normal[padded + r], out.normal[2 * padded + r]};
    Entry& e = entries_.back();
    FillEntry(t, normal, &e);
    const Eigen::Matrix3d& L = safety_L_[static_cast<size_t>(r)];
    const Eigen::Vector3d g = L * Eigen::Vector3d(normal[0], normal[1], normal[2]);
    const bool fixed_clear = out.low_fixed[r] > 1.0f + kCullMargin && (!t.sight || target_clear);
    for (int a = 0; a < 3; ++a) e.plane[a] = static_cast<float>(g[a]);
    for (int f = 0; f < free_; ++f) {
      double at = 1.0 + kCullMargin;
      for (int a = 0; a < 3; ++a)
        at += g[a] * columns_[static_cast<size_t>((6 + 3 * (4 + f) + a) * padded + r)];
      e.plane_at[f] = fixed_clear ? static_cast<float>(at) : 1e30f;
    }
  }
  // J2 of what may be near, by node.
  near_nodes_.clear();
  near_double_.clear();
  for (int k = 0; k < kNodes; ++k) {
    context_.near_begin[k] = static_cast<int>(near_nodes_.size());
    const double tau = GaussNodes().tau[k];
    for (int r = 0; r < rows; ++r) {
      const Task& t = tasks_[static_cast<size_t>(r)];
      if (!t.safety || !(near_[static_cast<size_t>(r)] >> k & 1u)) continue;
      const Ellipsoid& e = p.obstacles[static_cast<size_t>(t.obstacle)];
      const Eigen::Vector3d c = Evaluate(e.center, tau) - origin_;
      const double weight = config_.weight_obstacle * p.duration * GaussNodes().weight[k] *
                            (config_.cost_max - config_.cost_min) /
                            (config_.cost_range * config_.cost_range);
      NearNode node;
      for (int i = 0; i < 6; ++i) node.L[i] = columns_[static_cast<size_t>(i * padded + r)];
      for (int a = 0; a < 3; ++a) node.center[a] = static_cast<float>(c[a]);
      node.weight = static_cast<float>(weight);
      near_nodes_.push_back(node);
      near_double_.push_back({weight, t.obstacle});
    }
  }
  context_.near_begin[kNodes] = static_cast<int>(near_nodes_.size());
  tasks_ = active;
  order_.resize(entries_.size());
  for (size_t i = 0; i < order_.size(); ++i) order_[i] = static_cast<int>(i);
  PrepareContext();
  return true;
}

void FastSearch::FillEntry(const Task& task, const float* normal, Entry* e) {
  (void)normal;
  const Problem& p = *problem_;
  const int M = p.degree, D = 2 * M;
  const Ellipsoid& ellipsoid = p.obstacles[static_cast<size_t>(task.obstacle)];
  const Eigen::Matrix3d& R = task.safety ? ellipsoid.safety : ellipsoid.sight;
  const Eigen::Matrix3d L = Eigen::LLT<Eigen::Matrix3d>(R).matrixL();
  Curve center = ellipsoid.center;
  center.row(0) -= origin_.transpose();
  const Points o = ToPoints(center, M);
  Points z = Points::Zero(), q = Points::Zero();  // whitened
  for (int i = 0; i <= M; ++i) {
    q.row(i) = (target_.row(i) - o.row(i)) * L;
    if (i < 4) z.row(i) = (start_.row(i) - o.row(i)) * L;
  }
  const float l[6] = {(float)L(0, 0), (float)L(1, 0), (float)L(2, 0),
                      (float)L(1, 1), (float)L(2, 1), (float)L(2, 2)};
  std::copy(l, l + 6, e->L);
  for (int f = 0; f < free_; ++f) {
    const Eigen::RowVector3d c = o.row(4 + f) * L;
    for (int a = 0; a < 3; ++a) e->center[f][a] = static_cast<float>(c[a]);
  }
  const double size = L.cwiseAbs().colwise().sum().maxCoeff() * (reach_ + o.cwiseAbs().maxCoeff());
  e->margin = static_cast<float>(2e-5 * size * size + 1e-6);
  e->from = static_cast<float>(task.from);
  e->asks_safety = task.safety ? 1 : 0;
  e->asks_sight = task.sight ? 1 : 0;
  e->exact = config_.exact_visibility ? 1 : 0;
  double dq[13];
  const WeightTable& w = ProductWeights(M);
  for (int k = 0; k <= D; ++k) {
    double p_const = 0.0, s_const = 0.0, q_k = 0.0;
    for (int f = 0; f < free_; ++f)
      for (int a = 0; a < 3; ++a) e->p_lin[k][f][a] = e->s_lin[k][f][a] = 0.0f;
    for (int i = std::max(0, k - M); i <= std::min(M, k); ++i) {
      const int j = k - i;
      const double weight = w.value[i][j];
      q_k += weight * q.row(i).dot(q.row(j));
      if (i < 4) s_const += weight * z.row(i).dot(q.row(j));
      if (i < 4 && j < 4) p_const += weight * z.row(i).dot(z.row(j));
      if (i >= 4)
        for (int a = 0; a < 3; ++a) {
          e->s_lin[k][i - 4][a] = static_cast<float>(weight * q(j, a));
          if (j < 4) e->p_lin[k][i - 4][a] = static_cast<float>(2.0 * weight * z(j, a));
        }
    }
    e->p_const[k] = static_cast<float>(p_const);
    e->s_const[k] = static_cast<float>(s_const);
    dq[k] = q_k;
  }
  if (!task.sight) return;
  if (task.from > 0.0)
    for (int k = D; k > 0; --k)
      for (int i = 0; i < k; ++i) dq[i] = (1.0 - task.from) * dq[i] + task.from * dq[i + 1];
  for (int k = 0; k <= D; ++k) e->q[1][k] = static_cast<float>(dq[k]);
  double low = dq[0];
  for (int k = 1; k <= D; ++k) low = std::min(low, dq[k]);
  e->q_low[1] = static_cast<float>(low - 1.0) - 2.0f * e->margin;
  e->q_ready = 2u;
  // The target itself must stay outside, whoever follows it.
  if (low > 1.0 + e->margin) return;
  Ellipsoid alone = ellipsoid;
  alone.safety = R;
  alone.safety_from = task.from;
  if (!IsSafe(p.target, alone, Arithmetic::kCertified)) blocked_ = true;
}

void FastSearch::PrepareContext() {
  const Problem& p = *problem_;
  kernels::Context& c = context_;
  c.degree = p.degree;
  c.n_candidates = n_;
  c.stride = Padded(n_) + 4 * kLanes;
  x_.resize(static_cast<size_t>(3 * free_ * c.stride));
  j1_.resize(static_cast<size_t>(c.stride));
  c.x = x_.data();
  c.j1 = j1_.data();
  c.entries = entries_.data();
  c.order = order_.data();
  c.n_entries = static_cast<int>(entries_.size());
  c.near_nodes = near_nodes_.data();
  c.desired_distance = static_cast<float>(config_.desired_distance);
  c.yaw_floor = static_cast<float>(kYawDistanceFloor * kYawDistanceFloor);
  c.cost_range = static_cast<float>(config_.cost_range);
  // w1 J1 = sum over axes of (x - x*)' H (x - x*) + rest, H = U' U.
  const Eigen::MatrixXd H =
      tables_.smooth.block(4, 4, free_, free_) + 1e-12 * Eigen::MatrixXd::Identity(free_, free_);
  const Eigen::LLT<Eigen::MatrixXd> llt(H);
  const Eigen::MatrixXd U = llt.matrixU();
  double offset = 0.0;
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector4d b = start_.col(a).head<4>();
    const Eigen::VectorXd h = tables_.smooth.block(4, 0, free_, 4) * b;
    const Eigen::VectorXd best = -llt.solve(h);
    offset += b.dot(tables_.smooth.topLeftCorner<4, 4>() * b) + h.dot(best);
    for (int f = 0; f < free_; ++f) c.j1_center[f][a] = static_cast<float>(best[f]);
  }
  c.j1_offset = static_cast<float>(std::max(0.0, offset));
  for (int f = 0; f < free_; ++f)
    for (int g = 0; g < free_; ++g) c.j1_factor[f][g] = static_cast<float>(g >= f ? U(f, g) : 0.0);
  PrepareNodes();

  // Free points of all combinations of the later steps, then the first step's choices on top.
  const int nx = 3 * free_, first = choices_[0], blocks = (first + kLanes - 1) / kLanes;
  const int n_prefix = n_ / first;
  prefix_.resize(static_cast<size_t>(n_prefix * nx));
  for (int i = 0; i < n_prefix; ++i) {
    double z[9];
    std::copy(base_, base_ + nx, z);
    int rest = i;
    size_t at = static_cast<size_t>(first * nx);
    for (size_t s = 1; s < choices_.size(); ++s) {
      const size_t pull = at + static_cast<size_t>((rest % choices_[s]) * nx);
      for (int k = 0; k < nx; ++k) z[k] += pulls_[pull + static_cast<size_t>(k)];
      rest /= choices_[s];
      at += static_cast<size_t>(choices_[s] * nx);
    }
    for (int k = 0; k < nx; ++k)
      prefix_[static_cast<size_t>(i * nx + k)] = static_cast<float>(z[k]);
  }
  first_.assign(static_cast<size_t>(nx * blocks * kLanes), 0.0f);
  for (int s = 0; s < first; ++s)
    for (int k = 0; k < nx; ++k)
      first_[static_cast<size_t>(k * blocks * kLanes + s)] =
          static_cast<float>(pulls_[static_cast<size_t>(s * nx + k)]);
  kernels_.generate(c, prefix_.data(), n_prefix, first_.data(), first);
}

void FastSearch::PrepareNodes() {
  kernels::Context& c = context_;
  const double T = problem_->duration;
  for (int k = 0; k < kNodes; ++k) {
    for (int f = 0; f < free_; ++f) {
      c.phi[k][f] = static_cast<float>(tables_.phi[k][4 + f]);
      c.slope[k][f] = static_cast<float>(tables_.slope[k][4 + f]);
    }
    for (int a = 0; a < 3; ++a) {
      double p = 0.0, q = 0.0, v = 0.0, w = 0.0;
      for (int i = 0; i <= problem_->degree; ++i) {
        q += tables_.phi[k][i] * target_(i, a);
        w += tables_.slope[k][i] * target_(i, a);
        if (i >= 4) continue;
        p += tables_.phi[k][i] * start_(i, a);
        v += tables_.slope[k][i] * start_(i, a);
      }
      c.rel[k][a] = static_cast<float>(p - q);
      c.target[k][a] = static_cast<float>(q);
      if (a < 2) c.rel_rate[k][a] = static_cast<float>(v - w);
    }
    c.weight3[k] = static_cast<float>(config_.weight_distance * T * GaussNodes().weight[k]);
    c.weight4[k] = static_cast<float>(config_.weight_yaw * T * GaussNodes().weight[k]);
  }
}

Points FastSearch::PointsOf(int index) const {
  double z[9];
  const int nx = 3 * free_;
  std::copy(base_, base_ + nx, z);
  size_t at = 0;
  for (int choices : choices_) {
    const size_t pull = at + static_cast<size_t>((index % choices) * nx);
    for (int k = 0; k < nx; ++k) z[k] += pulls_[pull + static_cast<size_t>(k)];
    index /= choices;
    at += static_cast<size_t>(choices * nx);
  }
  Points b = start_;
  for (int f = 0; f < free_; ++f)
    for (int a = 0; a < 3; ++a) b(4 + f, a) = z[3 * f + a];
  return b;
}

Curve FastSearch::PlanOf(const Points& b) const {
  Curve plan = ToPower(b, problem_->degree);
  plan.topRows(4) = problem_->start;
  return plan;
}

Cost FastSearch::CostOf(const Points& b) const {
  const int M = problem_->degree;
  const double T = problem_->duration;
  Cost cost;
  double j1 = 0.0;
  for (int i = 0; i <= M; ++i)
    for (int j = 0; j <= M; ++j) j1 += tables_.smooth(i, j) * b.row(i).dot(b.row(j));
  double j2 = 0.0;
  for (int k = 0; k < kNodes; ++k) {
    double p[3] = {}, v[2] = {}, q[3] = {}, w[2] = {};
    for (int i = 0; i <= M; ++i)
      for (int a = 0; a < 3; ++a) {
        p[a] += tables_.phi[k][i] * b(i, a);
        q[a] += tables_.phi[k][i] * target_(i, a);
        if (a == 2) continue;
        v[a] += tables_.slope[k][i] * b(i, a);
        w[a] += tables_.slope[k][i] * target_(i, a);
      }
    const double r[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
    const double h = r[0] * r[0] + r[1] * r[1];
    const double excess = std::sqrt(h + r[2] * r[2]) - config_.desired_distance;
    const double rate = (r[0] * (w[1] - v[1]) - r[1] * (w[0] - v[0])) /
                        std::max(h, kYawDistanceFloor * kYawDistanceFloor);
    const double weight = T * GaussNodes().weight[k];
    cost.j3 += weight * excess * excess;
    cost.j4 += weight * rate * rate;
    for (int e = context_.near_begin[k]; e < context_.near_begin[k + 1]; ++e) {
      const Near& near = near_double_[static_cast<size_t>(e)];
      const Ellipsoid& o = problem_->obstacles[static_cast<size_t>(near.obstacle)];
      const Eigen::Vector3d d =
          Eigen::Vector3d(p[0], p[1], p[2]) + origin_ - Evaluate(o.center, GaussNodes().tau[k]);
      const double l = std::sqrt(d.dot(o.safety * d)) - config_.cost_range;
      if (l < 0.0) j2 += near.weight * l * l;
    }
  }
  const double far = config_.cost_min * T * static_cast<double>(problem_->obstacles.size());
  cost.j1 = config_.weight_smooth > 0.0 ? j1 / config_.weight_smooth : 0.0;
  cost.j2 = config_.weight_obstacle > 0.0 ? j2 / config_.weight_obstacle + far : far;
  cost.total = j1 + j2 + config_.weight_obstacle * far + config_.weight_distance * cost.j3 +
               config_.weight_yaw * cost.j4;
  return cost;
}

// Speed and acceleration by their control polygons first.
bool FastSearch::KeepsLimitsQuickly(const Points& b) const {
  const Limits& l = problem_->limits;
  const bool any = l.speed > 0.0 || l.acceleration > 0.0 || l.height || l.tan_elevation > 0.0 ||
                   l.min_distance > 0.0;
  return !any || KeepsLimits(PlanOf(b), *problem_);
}

bool FastSearch::Proven(int index) {
  const Points b = PointsOf(index);
  const Curve plan = PlanOf(b);
  for (const Task& t : tasks_) {
    const Ellipsoid& e = problem_->obstacles[static_cast<size_t>(t.obstacle)];
    if (t.safety && !IsSafe(plan, e, Arithmetic::kCertified)) return false;
    if (t.sight && !IsInSight(plan, problem_->target, e, t.from, config_.exact_visibility,
                              Arithmetic::kCertified))
      return false;
  }
  return true;
}

// ---- search

void FastSearch::Accept(int id, float cost) {
  if (!(cost < Limit())) return;
  close_.push_back({cost, id});
  best_ = std::min(best_, cost);
}

// Tests up to kBatch candidates with their lower bounds J1 + J3 + J4; adds J2 first when there is a
// bound to prune by.
void FastSearch::Batch(int* ids, float* lower, int n) {
  for (int i = n; i < kBatch + kLanes; ++i) lower[i] = 0.0f;
  kernels_.obstacles(context_, ids, lower, n);
  std::pair<float, int> sorted[kBatch];
  int count = 0;
  for (int i = 0; i < n; ++i)
    if (lower[i] < Limit() &&
        std::find(excluded_.begin(), excluded_.end(), ids[i]) == excluded_.end())
      sorted[count++] = {lower[i], ids[i]};
  std::sort(sorted, sorted + count);
  int left[kBatch + kLanes];
  uint8_t states[kBatch + kLanes];
  for (int i = 0; i < count; ++i) left[i] = sorted[i].second;
  checked_ += count;
  const int kept = kernels_.check(context_, left, states, count);
  int at = 0;
  for (int i = 0; i < kept; ++i) {
    while (sorted[at].second != left[i]) ++at;
    const float cost = sorted[at].first;
    if (!(cost < Limit())) break;
    if (!KeepsLimitsQuickly(PointsOf(left[i]))) continue;
    if (states[i] == kernels::kUnsure && !Proven(left[i])) continue;
    ++feasible_;
    Accept(left[i], cost);
  }
}

// Adds J3 + J4 to J1 of the candidates, drops those above `limit`, puts the rest on the heap.
void FastSearch::Weigh(std::vector<int>* ids, float limit) {
  int n = static_cast<int>(ids->size());
  ids->resize(static_cast<size_t>(n + kLanes));
  values_.resize(static_cast<size_t>(n + kLanes));
  for (int i = 0; i < n; ++i)
    values_[static_cast<size_t>(i)] = j1_[static_cast<size_t>((*ids)[static_cast<size_t>(i)])];
  n = kernels_.distance_and_yaw(context_, ids->data(), values_.data(), n, limit, 0, 4);
  n = kernels_.distance_and_yaw(context_, ids->data(), values_.data(), n, limit, 4, kNodes);
  for (int i = 0; i < n; ++i)
    heap_.push_back({values_[static_cast<size_t>(i)], (*ids)[static_cast<size_t>(i)]});
}

void FastSearch::Drain(int max_batches) {
  const auto later = [](const auto& a, const auto& b) { return a > b; };
  std::make_heap(heap_.begin(), heap_.end(), later);
  for (int batch = 0; batch < max_batches && !heap_.empty(); ++batch) {
    int ids[kBatch + kLanes];
    float lower[kBatch + kLanes];
    int n = 0;
    while (n < kBatch && !heap_.empty() && heap_.front().first < Limit()) {
      std::pop_heap(heap_.begin(), heap_.end(), later);
      lower[n] = heap_.back().first;
      ids[n++] = heap_.back().second;
      heap_.pop_back();
    }
    if (n == 0) return heap_.clear();
    Batch(ids, lower, n);
  }
}

// Nothing found among the cheapest: test what is left side by side in memory.
void FastSearch::CheckAll() {
  int n = static_cast<int>(heap_.size());
  rest_.resize(static_cast<size_t>(n + kLanes));
  for (int i = 0; i < n; ++i) rest_[static_cast<size_t>(i)] = heap_[static_cast<size_t>(i)].second;
  std::sort(rest_.begin(), rest_.begin() + n);
  std::vector<std::pair<int, float>> cost(static_cast<size_t>(n));
  for (int i = 0; i < n; ++i)
    cost[static_cast<size_t>(i)] = {heap_[static_cast<size_t>(i)].second,
                                    heap_[static_cast<size_t>(i)].first};
  std::sort(cost.begin(), cost.end());
  heap_.clear();
  states_.resize(static_cast<size_t>(n + kLanes));
  n = kernels_.check(context_, rest_.data(), states_.data(), n);
  size_t at = 0;
  for (int i = 0; i < n; ++i) {
    while (cost[at].first != rest_[static_cast<size_t>(i)]) ++at;
    heap_.push_back({cost[at].second, cost[at].first});
  }
}

void FastSearch::Run() {
  best_ = HUGE_VALF;
  winner_ = -1;
  close_.clear();
  heap_.clear();
  // Most promising by J1: a sample of 256 tells the value that about 1 in 32 stays below.
  const int wanted = std::min(n_, std::max(64, n_ / 32)), samples = std::min(256, n_);
  float sample[256];
  for (int i = 0; i < samples; ++i)
    sample[i] = j1_[static_cast<size_t>(static_cast<int64_t>(i) * n_ / samples)];
  const int rank =
      std::min(samples - 1, static_cast<int>(static_cast<int64_t>(samples) * wanted / n_));
  std::nth_element(sample, sample + rank, sample + samples);
  const float threshold = sample[rank];
  ids_.resize(static_cast<size_t>(context_.stride + kLanes));
  ids_.resize(static_cast<size_t>(kernels_.select(context_, -1.0f, threshold, ids_.data())));
  Weigh(&ids_, Limit());
  Drain(8);
  ids_.resize(static_cast<size_t>(context_.stride + kLanes));
  ids_.resize(static_cast<size_t>(kernels_.select(context_, threshold, Limit(), ids_.data())));
  Weigh(&ids_, Limit());
  if (close_.empty()) {
    Drain(std::max(2, n_ / 64));
    if (close_.empty()) CheckAll();
  }
  Drain(1 << 30);
  // Single precision leaves a few that could be the best: double decides, the lower index on ties.
  double lowest = HUGE_VAL;
  std::sort(close_.begin(), close_.end(),
            [](const auto& a, const auto& b) { return a.second < b.second; });
  for (const auto& [cost, id] : close_) {
    if (!(cost < Limit())) continue;
    const double total = CostOf(PointsOf(id)).total;
    if (total >= lowest) continue;
    lowest = total;
    winner_ = id;
  }
}

}  // namespace

std::unique_ptr<Search> MakeFastSearch(const PlannerConfig& config) {
  return MakeFastSearch(config, kernels::Kernels());
}

std::unique_ptr<Search> MakeFastSearch(const PlannerConfig& config, const kernels::Table& table) {
  return std::make_unique<FastSearch>(config, table);
}

}  // namespace chase::planning
