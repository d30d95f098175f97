#pragma once

#include <functional>

#include "logs/src/regression.h"

namespace chase::logs {

/// Of what answers late: first a delay, then a first-order lag.
struct Lags {
  double lag = 0.03;   ///< time constant, s
  double delay = 0.0;  ///< s
};

struct LaggedSolution {
  Lags at;
  Solution solution;  ///< of the coefficients and, behind them, of lag and delay
};

/// The lags, from 0 to 0.3 s, at which a regression explains most, and its coefficients there:
/// a grid, then Gauss-Newton steps. `model` gives the regression at some lags.
LaggedSolution SolveLagged(const std::function<Regression(const Lags&)>& model);

}  // namespace chase::logs
