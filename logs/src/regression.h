#pragma once

#include <Eigen/Core>

namespace chase::logs {

/// A linear regression over time. `rows` of X (n rows x p) and y belong to each instant. What is
/// known of the coefficients beforehand: about 0, with the standard deviations `prior`.
struct Regression {
  Eigen::MatrixXd X;
  Eigen::VectorXd y, prior;
  int rows = 1;
  int memory = 0;  ///< instants of the autoregression that the noise is taken for, fewer than
                   ///< there are; 0: white
};

struct Solution {
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;  ///< of `value`
  double cost = 0.0;  ///< twice the sum of Huber's function of the residuals, whose bend is at
                      ///< three of their own deviations
};

/// Least squares with Huber's weights (beyond three deviations; Huber 1964), where the noise has a
/// memory of data that its autoregression has whitened (Cochrane, Orcutt 1949): a loop that answers
/// to the noise of the past does not bias them then (Ljung, System Identification, section 13.4).
/// The covariance holds for residuals that are correlated over time, up to a tenth of what is
/// given: the sandwich with Bartlett's weights (Newey, West 1987; Kiefer, Vogelsang 2005, b = 0.1).
Solution Solve(const Regression& regression);

}  // namespace chase::logs
