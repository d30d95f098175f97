#include "services/planning/reference_search.h"

#include <Eigen/LU>
#include <cmath>

#include "services/planning/cost.h"

namespace chase::planning {
namespace {

double Factorial(int n) { return n <= 1 ? 1.0 : n * Factorial(n - 1); }

class ReferenceSearch : public Search {
 public:
  ReferenceSearch(const PlannerConfig& config, Arithmetic arithmetic)
      : config_(config), arithmetic_(arithmetic) {}

  using Search::Best;
  Found Best(const Problem& problem, double sight_from, double /*bound*/,
             PlanProof* /*proof*/) override {
    const Eigen::MatrixXd K_inverse = InverseKkt(config_, problem);
    Found found;
    found.generated = problem.n_candidates();
    for (int i = 0; i < found.generated; ++i) {
      const Curve plan = ReferenceCandidate(config_, problem, K_inverse, i);
      ++found.checked;
      if (!IsFeasible(plan, problem, sight_from, config_.exact_visibility, arithmetic_)) continue;
      ++found.feasible;
      const Cost cost = Evaluate(config_, problem, plan);
      if (found.index >= 0 && !(cost.total < found.cost.total)) continue;
      found.index = i;
      found.plan = plan;
      found.cost = cost;
    }
    return found;
  }

 private:
  PlannerConfig config_;
  Arithmetic arithmetic_;
};

}  // namespace

Eigen::MatrixXd InverseKkt(const PlannerConfig& config, const Problem& problem) {
  const int n = problem.degree + 1, steps = static_cast<int>(problem.skeletons.size());
  const double T = problem.duration;
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(n, n);
  for (int i = 2; i < n; ++i)
    for (int j = 2; j < n; ++j) M(i, j) = i * (i - 1.0) * j * (j - 1.0) / (i + j - 3.0);
  M /= T * T * T;
  for (int k = 1; k <= steps; ++k) {
    Eigen::VectorXd basis(n);
    for (int i = 0; i < n; ++i) basis[i] = std::pow(static_cast<double>(k) / steps, i);
    M += config.waypoint_weight * basis * basis.transpose();
  }
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(n + 4, n + 4);
  K.topLeftCorner(n, n) = 2.0 * M;
  for (int k = 0; k < 4; ++k) K(n + k, k) = K(k, n + k) = Factorial(k);
  return K.fullPivLu().inverse();
}

Curve ReferenceCandidate(const PlannerConfig& config, const Problem& problem,
                         const Eigen::MatrixXd& K_inverse, int index) {
  const int n = problem.degree + 1;
  const int steps = static_cast<int>(problem.skeletons.size());
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(n + 4, 3);
  for (int k = 0; k < steps; ++k) {
    const auto& choices = problem.skeletons[static_cast<size_t>(k)];
    const auto& u = choices[static_cast<size_t>(index) % choices.size()];
    index /= static_cast<int>(choices.size());
    for (int i = 0; i < n; ++i)
      y.row(i) += 2.0 * config.waypoint_weight * std::pow(static_cast<double>(k + 1) / steps, i) *
                  u.transpose();
  }
  for (int k = 0; k < 4; ++k) y.row(n + k) = Factorial(k) * problem.start.row(k);
  Curve plan = (K_inverse * y).topRows(n);
  plan.topRows(4) = problem.start;
  return plan;
}

std::unique_ptr<Search> MakeReferenceSearch(const PlannerConfig& config, Arithmetic arithmetic) {
  return std::make_unique<ReferenceSearch>(config, arithmetic);
}

}  // namespace chase::planning
