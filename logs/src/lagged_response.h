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
  Solution solution;       ///< of the coefficients at these lags and, behind them, lag and delay
  Eigen::MatrixXd slopes;  ///< of what is explained, by each of them
  bool converged = false;  ///< to lags within their range, as near as they are uncertain
};

/// The lags at which a regression explains most, and its coefficients there: a grid, then
/// Gauss-Newton steps. `model` gives the regression at some lags. The lag is sought from 0.002 to
/// 0.3 s, the delay from -0.02 s, which noise may make of none, to 0.3 s.
LaggedSolution SolveLagged(const std::function<Regression(const Lags&)>& model);

}  // namespace chase::logs
