#include "logs/src/lagged_response.h"

#include <algorithm>
#include <cmath>

namespace chase::logs {
namespace {

using Model = std::function<Regression(const Lags&)>;

constexpr double kStep = 1e-3;   // s: of the difference quotients, a fifth of a sample's period
constexpr double kMost = 0.3;    // s: the bound of control's `lead`
constexpr double kClose = 1e-5;  // s: a step that is none
constexpr int kSteps = 15, kHalvings = 6;

// A delay somewhat below 0 is within the noise of one that is 0.
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

}  // namespace

LaggedSolution SolveLagged(const Model& model) {
  Lags at = BestOfGrid(model);
  for (int i = 0;; ++i) {
    const Solution linear = Solve(model(at));
    const Eigen::Index p = linear.value.size();
    LaggedSolution result = {at, Solve(Linearised(model, at, linear.value))};
    const Lags next =
        Improved(model, at, {result.solution.value[p], result.solution.value[p + 1]}, linear.cost);
    const double step = std::abs(next.lag - at.lag) + std::abs(next.delay - at.delay);
    if (step < kClose || i == kSteps) return result;
    at = next;
  }
}

}  // namespace chase::logs
