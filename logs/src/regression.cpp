#include "logs/src/regression.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace chase::logs {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kOutlier = 3.0;    // deviations: 0.3 % of a normal distribution is beyond
constexpr double kNormal = 1.4826;  // standard deviation over median deviation, normal distribution
constexpr double kBandwidth = 0.1;  // b of Kiefer, Vogelsang: of the series
// So few windows are themselves uncertain: 95 % of estimates lie within 2.26 of their deviations,
// not 1.96 (Kiefer, Vogelsang 2005, table 1).
constexpr double kSpread = 2.26 / 1.96;
constexpr int kWhitenings = 2;
constexpr int kIterations = 4;        // of the weights
constexpr double kLeastNoise = 1e-9;  // of the residuals: exact data have none

double Deviation(const VectorXd& residual) {
  VectorXd size = residual.cwiseAbs();
  double* const middle = size.data() + size.size() / 2;
  std::nth_element(size.data(), middle, size.data() + size.size());
  return std::max(kLeastNoise, kNormal * *middle);
}

VectorXd Weights(const VectorXd& residual, double sigma) {
  const double most = kOutlier * sigma;
  return residual.unaryExpr([most](double r) { return most / std::max(most, std::abs(r)); });
}

/// What residuals in the width of a window sum up to, over all windows that touch the series:
/// their mean product is the sum of autocovariances with Bartlett's weights.
MatrixXd LongRun(const MatrixXd& scores) {
  const auto n = scores.rows(), p = scores.cols();
  const auto width = std::max<Eigen::Index>(1, std::lround(kBandwidth * static_cast<double>(n)));
  MatrixXd sum = MatrixXd::Zero(p, p);
  VectorXd window = VectorXd::Zero(p);
  for (Eigen::Index i = 0; i < n + width - 1; ++i) {
    if (i < n) window += scores.row(i).transpose();
    if (i >= width) window -= scores.row(i - width).transpose();
    sum += window * window.transpose();
  }
  return kSpread * kSpread / static_cast<double>(width) * sum;
}

MatrixXd Scores(const Regression& r, const VectorXd& residual) {
  const Eigen::Index n = r.X.rows() / r.rows;
  MatrixXd scores = MatrixXd::Zero(n, r.X.cols());
  for (Eigen::Index i = 0; i < n * r.rows; ++i) scores.row(i / r.rows) += residual[i] * r.X.row(i);
  return scores;
}

/// Yule and Walker's equations for what the residuals of earlier instants tell of each.
VectorXd Autoregression(const VectorXd& residual, int rows, int memory) {
  VectorXd covariance(memory + 1);
  const Eigen::Index n = residual.size();
  for (int lag = 0; lag <= memory; ++lag)
    covariance[lag] = residual.head(n - lag * rows).dot(residual.tail(n - lag * rows));
  MatrixXd toeplitz(memory, memory);
  for (int i = 0; i < memory; ++i)
    for (int j = 0; j < memory; ++j) toeplitz(i, j) = covariance[std::abs(i - j)];
  toeplitz.diagonal().array() += kLeastNoise * covariance[0] + kLeastNoise;
  return toeplitz.ldlt().solve(covariance.tail(memory));
}

/// Without what earlier instants tell; the first ones are left out.
Regression Whitened(const Regression& r, const VectorXd& share) {
  Regression white = r;
  const Eigen::Index skipped = share.size() * r.rows, n = r.y.size() - skipped;
  white.X = r.X.bottomRows(n);
  white.y = r.y.tail(n);
  for (Eigen::Index lag = 1; lag <= share.size(); ++lag) {
    white.X -= share[lag - 1] * r.X.middleRows(skipped - lag * r.rows, n);
    white.y -= share[lag - 1] * r.y.segment(skipped - lag * r.rows, n);
  }
  return white;
}

Solution SolveWhite(const Regression& r) {
  const MatrixXd known = r.prior.cwiseInverse().cwiseAbs2().asDiagonal();
  Solution s;
  VectorXd weights = VectorXd::Ones(r.y.size()), residual;
  double sigma = 0.0;
  for (int i = 0; i < kIterations; ++i) {
    const MatrixXd weighted = weights.asDiagonal() * r.X;
    const double scale = i == 0 ? 1.0 : sigma;
    const MatrixXd information = r.X.transpose() * weighted / (scale * scale) + known;
    s.value = information.ldlt().solve(weighted.transpose() * r.y / (scale * scale));
    residual = r.y - r.X * s.value;
    sigma = Deviation(residual);
    weights = Weights(residual, sigma);
  }
  const VectorXd inside = weights.unaryExpr([](double w) { return w < 1.0 ? 0.0 : 1.0; });
  const VectorXd pulled = weights.cwiseProduct(residual);
  const double variance = sigma * sigma;
  const MatrixXd information = r.X.transpose() * inside.asDiagonal() * r.X / variance + known;
  const MatrixXd bread = information.ldlt().solve(MatrixXd::Identity(r.X.cols(), r.X.cols()));
  const MatrixXd meat = LongRun(Scores(r, pulled)) / (variance * variance) + known;
  s.covariance = bread * meat * bread;
  s.cost = pulled.dot(2.0 * residual - pulled);
  return s;
}

}  // namespace

Solution Solve(const Regression& r) {
  Solution s = SolveWhite(r);
  if (r.memory == 0) return s;
  for (int i = 0; i < kWhitenings; ++i)
    s = SolveWhite(Whitened(r, Autoregression(r.y - r.X * s.value, r.rows, r.memory)));
  return s;
}

}  // namespace chase::logs
