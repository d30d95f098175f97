#include "services/prediction/hull_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace chase::prediction {
namespace {

bool Allowed(const HullPoint& hull, int step, int point) {
  return (hull.allowed[static_cast<size_t>(step)] >> point & 1U) != 0;
}

// Value, gradient and curvature of the cost at delta.
struct Local {
  double cost, slope;  // slope: of the exponential
  Eigen::VectorXd exponent_gradient, gradient;
};

Local Linearise(const CandidateSet& c, const Eigen::VectorXd& delta) {
  const auto& A = c.smoothness();
  const auto& B = c.exponent();
  const Eigen::VectorXd HA = A.hessian_half * delta, HB = B.hessian_half * delta;
  const double exponent = B.constant + delta.dot(B.gradient + HB);
  Local local{A.constant + delta.dot(A.gradient + HA) + GuardedExp(exponent),
              GuardedExpSlope(exponent),
              B.gradient + 2.0 * HB,
              {}};
  local.gradient = A.gradient + 2.0 * HA + local.slope * local.exponent_gradient;
  return local;
}

double Curvature(const CandidateSet& c, const Local& local, const Eigen::VectorXd& d) {
  const double along = local.exponent_gradient.dot(d);
  return 2.0 * d.dot(c.smoothness().hessian_half * d) +
         local.slope * (2.0 * d.dot(c.exponent().hessian_half * d) + along * along);
}

double BoundAt(const CandidateSet& c, const HullPoint& hull, const Local& local,
               Eigen::MatrixXd* reduced) {
  double bound = local.cost;
  for (int n = 0; n < c.steps(); ++n) {
    const Eigen::VectorXd price = c.contributions(n).transpose() * local.gradient;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < c.samples(); ++i)
      if (Allowed(hull, n, i)) least = std::min(least, price[i]);
    reduced->col(n) = price.array() - least;
    bound += least - price.dot(hull.weights.col(n));
  }
  return bound;
}

// Shifts weight of one step from its worst point to its best one, as far as the local quadratic
// asks for.
void PairwiseStep(const CandidateSet& c, int n, HullPoint* hull) {
  const Local local = Linearise(c, hull->delta);
  const Eigen::VectorXd price = c.contributions(n).transpose() * local.gradient;
  int best = -1, worst = -1;
  for (int i = 0; i < c.samples(); ++i) {
    if (!Allowed(*hull, n, i)) continue;
    if (best < 0 || price[i] < price[best]) best = i;
    if (hull->weights(i, n) > 0.0 && (worst < 0 || price[i] > price[worst])) worst = i;
  }
  if (best < 0 || worst < 0 || best == worst) return;
  const Eigen::VectorXd d = c.contributions(n).col(best) - c.contributions(n).col(worst);
  const double curvature = Curvature(c, local, d);
  const double wanted =
      curvature > 0.0 ? -local.gradient.dot(d) / curvature : hull->weights(worst, n);
  const double shift = std::clamp(wanted, 0.0, hull->weights(worst, n));
  hull->weights(worst, n) -= shift;
  hull->weights(best, n) += shift;
  hull->delta += shift * d;
}

void Move(const CandidateSet& c, int step, const Eigen::VectorXd& weights, HullPoint* hull) {
  hull->delta += c.contributions(step) * (weights - hull->weights.col(step));
  hull->weights.col(step) = weights;
}

}  // namespace

HullPoint WholeHull(const CandidateSet& c) {
  HullPoint hull;
  hull.allowed.assign(static_cast<size_t>(c.steps()), (1U << c.samples()) - 1U);
  hull.weights = Eigen::MatrixXd::Constant(c.samples(), c.steps(), 1.0 / c.samples());
  hull.delta = Eigen::VectorXd::Zero(c.dims());
  for (int n = 0; n < c.steps(); ++n) hull.delta += c.contributions(n) * hull.weights.col(n);
  return hull;
}

bool Forbid(const CandidateSet& c, int step, int point, HullPoint* hull) {
  hull->allowed[static_cast<size_t>(step)] &= ~(1U << point);
  if (hull->allowed[static_cast<size_t>(step)] == 0) return false;
  Eigen::VectorXd weights = hull->weights.col(step);
  const double freed = weights[point];
  weights[point] = 0.0;
  int heaviest = -1;
  for (int i = 0; i < c.samples(); ++i)
    if (Allowed(*hull, step, i) && (heaviest < 0 || weights[i] > weights[heaviest])) heaviest = i;
  weights[heaviest] += freed;
  if (freed > 0.0) Move(c, step, weights, hull);
  return true;
}

void Fix(const CandidateSet& c, int step, int point, HullPoint* hull) {
  hull->allowed[static_cast<size_t>(step)] = 1U << point;
  Move(c, step, Eigen::VectorXd::Unit(c.samples(), point), hull);
}

double HullLowerBound(const CandidateSet& c, int rounds, double enough, HullPoint* hull,
                      Eigen::MatrixXd* reduced) {
  double best = -std::numeric_limits<double>::infinity();
  Eigen::MatrixXd candidate(c.samples(), c.steps());
  for (int round = 0;; ++round) {
    const Local local = Linearise(c, hull->delta);
    const double bound = BoundAt(c, *hull, local, &candidate);
    if (bound > best) {
      best = bound;
      *reduced = candidate;
    }
    if (best >= enough || round == rounds || local.cost - bound < 1e-7 * std::abs(local.cost))
      return best - 1e-12 * std::abs(best);
    for (int n = 0; n < c.steps(); ++n)
      if (hull->allowed[static_cast<size_t>(n)] & (hull->allowed[static_cast<size_t>(n)] - 1U))
        PairwiseStep(c, n, hull);
  }
}

}  // namespace chase::prediction
