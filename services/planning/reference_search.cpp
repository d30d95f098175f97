#include "services/planning/reference_search.h"

#include <Eigen/LU>
#include <algorithm>

#include "services/planning/cost.h"
#include "services/planning/limits.h"
#include "services/planning/sturm_check.h"

namespace chase::planning {
namespace {

double Factorial(int n) { return n <= 1 ? 1.0 : n * Factorial(n - 1); }

/// 1, x, x^2, ... x^(n-1).
Eigen::VectorXd Powers(double x, int n) {
  Eigen::VectorXd powers = Eigen::VectorXd::Ones(n);
  for (int i = 1; i < n; ++i) powers[i] = x * powers[i - 1];
  return powers;
}

/// K^-1 of section IV-B, with the objective (11) in normalised time.
Eigen::MatrixXd InverseKkt(const PlannerConfig& config, const Problem& problem) {
  const int n = problem.degree + 1, steps = static_cast<int>(problem.skeletons.size());
  const double T = problem.duration;
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(n, n);
  for (int i = 2; i < n; ++i)
    for (int j = 2; j < n; ++j) M(i, j) = i * (i - 1.0) * j * (j - 1.0) / (i + j - 3.0);
  M /= T * T * T;
  for (int k = 1; k <= steps; ++k) {
    const Eigen::VectorXd basis = Powers(static_cast<double>(k) / steps, n);
    M += config.waypoint_weight * basis * basis.transpose();
  }
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(n + 4, n + 4);
  K.topLeftCorner(n, n) = 2.0 * M;
  for (int k = 0; k < 4; ++k) K(n + k, k) = K(k, n + k) = Factorial(k);
  return K.fullPivLu().inverse();
}

/// Sections IV and V; `IsFeasible` and the costs belong to one problem.
template <class IsFeasible>
Found TestAll(const PlannerConfig& config, const Problem& problem, const IsFeasible& is_feasible) {
  const KktCandidates candidates(config, problem);
  const Objective objective(config, problem);
  Found found;
  found.generated = problem.n_candidates();
  for (int i = 0; i < found.generated; ++i) {
    const Curve plan = candidates(i);
    ++found.checked;
    if (!is_feasible(plan)) continue;
    ++found.feasible;
    const Cost cost = objective(plan);
    if (found.index >= 0 && !(cost.total < found.cost.total)) continue;
    found.index = i;
    found.plan = plan;
    found.cost = cost;
  }
  return found;
}

class ReferenceSearch : public Search {
 public:
  ReferenceSearch(const PlannerConfig& config, Arithmetic arithmetic)
      : config_(config), arithmetic_(arithmetic) {}

  using Search::Best;
  Found Best(const Problem& problem, double sight_from, double /*bound*/,
             PlanProof* /*proof*/) override {
    if (arithmetic_ == Arithmetic::kDoubleSturm) return BestBySturm(problem, sight_from);
    return TestAll(config_, problem, [&](const Curve& plan) {
      return IsFeasible(plan, problem, sight_from, config_.exact_visibility, arithmetic_);
    });
  }

 private:
  Found BestBySturm(const Problem& problem, double sight_from) const {
    std::vector<SturmCheck> checks;
    for (const Ellipsoid& e : problem.obstacles)
      checks.emplace_back(problem.target, e, sight_from, problem.degree + 1);
    return TestAll(config_, problem, [&](const Curve& plan) {
      return plan.allFinite() && KeepsLimits(plan, problem) &&
             std::all_of(checks.begin(), checks.end(),
                         [&](const SturmCheck& check) { return check.IsClear(plan); });
    });
  }

  PlannerConfig config_;
  Arithmetic arithmetic_;
};

}  // namespace

KktCandidates::KktCandidates(const PlannerConfig& config, const Problem& problem) {
  const int n = problem.degree + 1, steps = static_cast<int>(problem.skeletons.size());
  const Eigen::MatrixXd inverse = InverseKkt(config, problem).topRows(n);
  Eigen::Matrix<double, 4, 3> derivatives = problem.start;
  for (int k = 0; k < 4; ++k) derivatives.row(k) *= Factorial(k);
  base_ = inverse.rightCols(4) * derivatives;
  base_.topRows(4) = problem.start;
  for (int k = 0; k < steps; ++k) {
    Eigen::VectorXd pull = 2.0 * config.waypoint_weight * inverse.leftCols(n) *
                           Powers(static_cast<double>(k + 1) / steps, n);
    pull.head(4).setZero();  // but for roundings it is
    terms_.emplace_back();
    for (const Eigen::Vector3d& u : problem.skeletons[static_cast<size_t>(k)])
      terms_.back().push_back(pull * u.transpose());
  }
}

Curve KktCandidates::operator()(int index) const {
  Curve plan = base_;
  for (const std::vector<Curve>& choices : terms_) {
    const int n = static_cast<int>(choices.size());
    plan += choices[static_cast<size_t>(index % n)];
    index /= n;
  }
  return plan;
}

std::unique_ptr<Search> MakeReferenceSearch(const PlannerConfig& config, Arithmetic arithmetic) {
  return std::make_unique<ReferenceSearch>(config, arithmetic);
}

}  // namespace chase::planning
