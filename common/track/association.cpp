#include "common/track/association.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace chase::track {

namespace {

constexpr int kMostRounds = 100;   // of messages; they converge (Williams and Lau, theorem 1)
constexpr double kSettled = 1e-6;  // greatest change of a message at which they have
constexpr double kSure = 1e-9;     // of a detection or existence: never quite 0 or 1

double Inside(double probability) { return std::clamp(probability, kSure, 1.0 - kSure); }

}  // namespace

Association Associate(const std::vector<Prior>& tracks, const Eigen::MatrixXd& ratio) {
  const auto n = static_cast<Eigen::Index>(tracks.size()), m = ratio.cols();
  // Row i: odds of the pairs (i, j) over that of no pair.
  Eigen::MatrixXd odds(n, m);
  Eigen::VectorXd missed(n);  // existence if there is no measurement of it
  for (Eigen::Index i = 0; i < n; ++i) {
    const Prior& prior = tracks[static_cast<size_t>(i)];
    const double r = Inside(prior.existence), detected = r * Inside(prior.detection);
    odds.row(i) = detected / (1.0 - detected) * ratio.row(i).cwiseMax(0.0).cwiseMin(1e12);
    missed[i] = (r - detected) / (1.0 - detected);
  }
  // Messages of the measurements to the tracks: share of a pair's odds that other tracks leave it.
  Eigen::MatrixXd left = Eigen::MatrixXd::Ones(n, m), claim(n, m);
  for (int round = 0; round < kMostRounds; ++round) {
    const Eigen::VectorXd total = (odds.cwiseProduct(left)).rowwise().sum();
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < m; ++j)
        claim(i, j) = odds(i, j) / (1.0 + std::max(0.0, total[i] - odds(i, j) * left(i, j)));
    const Eigen::RowVectorXd claims = claim.colwise().sum();
    double change = 0.0;
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < m; ++j) {
        const double next = 1.0 / (1.0 + std::max(0.0, claims[j] - claim(i, j)));
        change = std::max(change, std::abs(next - left(i, j)));
        left(i, j) = next;
      }
    if (change < kSettled) break;
  }
  Association result;
  result.probability.resize(n, m + 1);
  result.existence.resize(n);
  result.fresh = (1.0 + claim.colwise().sum().array()).inverse().matrix().transpose();
  if (n == 0) result.fresh = Eigen::VectorXd::Ones(m);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::RowVectorXd own = odds.row(i).cwiseProduct(left.row(i));
    const double all = 1.0 + own.sum();
    result.probability.row(i) << own / all, 1.0 / all;
    result.existence[i] = (own.sum() + missed[i]) / all;
  }
  return result;
}

std::vector<int> Assign(const Association& association, double least) {
  const auto n = association.probability.rows(), m = association.probability.cols() - 1;
  std::vector<std::tuple<double, int, int>> pairs;
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < m; ++j)
      if (association.probability(i, j) >= least)
        pairs.emplace_back(-association.probability(i, j), static_cast<int>(i),
                           static_cast<int>(j));
  std::sort(pairs.begin(), pairs.end());
  std::vector<int> of(static_cast<size_t>(n), -1);
  std::vector<char> taken(static_cast<size_t>(std::max<Eigen::Index>(m, 0)), 0);
  for (const auto& [p, i, j] : pairs) {
    if (of[static_cast<size_t>(i)] >= 0 || taken[static_cast<size_t>(j)]) continue;
    of[static_cast<size_t>(i)] = j;
    taken[static_cast<size_t>(j)] = 1;
  }
  return of;
}

double Survival(double existence, double dt, double lifetime) {
  return existence * std::exp(-dt / lifetime);
}

}  // namespace chase::track
