#include "logs/src/lagged_response.h"

#include <algorithm>
#include <cmath>

namespace chase::logs {
namespace {

using Model = std::function<Regression(const Lags&)>;

constexpr double kStep = 1e-3;   // s: of the difference quotients, small beside any lag
constexpr double kMost = 0.3;    // s: the bound of control's `lead`
constexpr double kClose = 1e-5;  // s: a step that is none
constexpr int kSteps = 15, kHalvings = 6;

Lags Bounded(const Lags& lags) {
  return {std::clamp(lags.lag, 2.0 * kStep, kMost), std::clamp(lags.delay, -0.02, kMost)};
}

Lags BestOfGrid(const Model& model) {
  Lags best;
  double least = Solve(model(best)).cost;
  for (const double lag : {0.01, 0.03, 0.06, 0.12})
    for (const double delay : {0.0, 0.02, 0.05, 0.1})
      if (const double cost = Solve(model({lag, delay})).cost; cost < least)
        least = cost, best = {lag, delay};
  return best;
}

/// Linear in the lags as well, about `at`: their columns stand last.
Regression Linearised(const Model& model, const Lags& at, const Eigen::VectorXd& value) {
  Regression r = model(at);
  const Eigen::Index p = r.X.cols();
  const auto change = [&](double lag, double delay) -> Eigen::VectorXd {
    const Regression above = model({at.lag + lag, at.delay + delay});
    return (above.X - model({at.lag - lag, at.delay - delay}).X) * value / (2.0 * kStep);
  };
  r.X.conservativeResize(Eigen::NoChange, p + 2);
  r.X.col(p) = change(kStep, 0.0);
  r.X.col(p + 1) = change(0.0, kStep);
  r.y += r.X.col(p) * at.lag + r.X.col(p + 1) * at.delay;
  r.prior.conservativeResize(p + 2);
  r.prior.tail<2>().setConstant(kMost);
  return r;
}

/// Towards `aim`, as far as it explains more; where it does nowhere, `at`.
Lags Improved(const Model& model, const Lags& at, const Lags& aim, double cost) {
  double share = 1.0;
  for (int i = 0; i < kHalvings; ++i, share /= 2.0) {
    const Lags next =
        Bounded({at.lag + share * (aim.lag - at.lag), at.delay + share * (aim.delay - at.delay)});
    if (Solve(model(next)).cost < cost) return next;
  }
  return at;
}

/// Whether the lags are in their range, and a whole step from them is within the uncertainty.
bool Converged(const Lags& at, const Solution& linearised) {
  const Eigen::Index p = linearised.value.size() - 2;
  const Eigen::Vector2d step = linearised.value.tail<2>() - Eigen::Vector2d(at.lag, at.delay);
  const Lags within = Bounded({at.lag - kClose, at.delay - kClose});
  return step[0] * step[0] <= linearised.covariance(p, p) &&
         step[1] * step[1] <= linearised.covariance(p + 1, p + 1) && within.lag < at.lag &&
         within.delay < at.delay && at.lag < kMost && at.delay < kMost;
}

}  // namespace

LaggedSolution SolveLagged(const Model& model) {
  LaggedSolution result;
  result.at = BestOfGrid(model);
  for (int i = 0;; ++i) {
    const Lags at = result.at;
    const Solution linear = Solve(model(at));
    const Eigen::Index p = linear.value.size();
    const Regression linearised = Linearised(model, at, linear.value);
    result.solution = Solve(linearised);
    const Eigen::Vector2d aim = result.solution.value.tail<2>();
    result.at = Improved(model, at, {aim[0], aim[1]}, linear.cost);
    const double step = std::abs(result.at.lag - at.lag) + std::abs(result.at.delay - at.delay);
    if (step >= kClose && i < kSteps) continue;
    result.at = at;
    result.converged = step < kClose && Converged(at, result.solution);
    result.slopes = linearised.X;
    result.solution.value.head(p) = linear.value;
    result.solution.value.tail<2>() << at.lag, at.delay;
    return result;
  }
}

}  // namespace chase::logs
