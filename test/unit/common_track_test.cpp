#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/track/association.h"

namespace chase::track {
namespace {

/// Sums over all joint events, one track after the other.
struct Enumeration {
  const std::vector<Prior>& tracks;
  const Eigen::MatrixXd& ratio;
  Eigen::MatrixXd pair;  ///< weight of the events with pair (i, j)
  Eigen::VectorXd existence, fresh;
  double total = 0.0;
  std::vector<int> of;

  Enumeration(const std::vector<Prior>& t, const Eigen::MatrixXd& r)
      : tracks(t),
        ratio(r),
        pair(Eigen::MatrixXd::Zero(r.rows(), r.cols() + 1)),
        existence(Eigen::VectorXd::Zero(r.rows())),
        fresh(Eigen::VectorXd::Zero(r.cols())) {
    Visit(0, 1.0);
    pair /= total, existence /= total, fresh /= total;
  }
  void Visit(size_t i, double weight) {
    if (i == tracks.size()) return Count(weight);
    const double detected = tracks[i].existence * tracks[i].detection;
    of.push_back(-1);
    Visit(i + 1, weight * (1.0 - detected));
    for (int j = 0; j < ratio.cols(); ++j) {
      of.back() = -1;
      if (std::count(of.begin(), of.end(), j)) continue;
      of.back() = j;
      Visit(i + 1, weight * detected * ratio(static_cast<int>(i), j));
    }
    of.pop_back();
  }
  void Count(double weight) {
    total += weight;
    for (size_t i = 0; i < of.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double r = tracks[i].existence, d = tracks[i].detection;
      pair(row, of[i] < 0 ? ratio.cols() : of[i]) += weight;
      existence[row] += weight * (of[i] < 0 ? r * (1.0 - d) / (1.0 - r * d) : 1.0);
    }
    for (int j = 0; j < ratio.cols(); ++j)
      if (!std::count(of.begin(), of.end(), j)) fresh[j] += weight;
  }
};

struct Draw {
  std::vector<Prior> tracks;
  Eigen::MatrixXd ratio;
  Draw(int n, int m, double in_gate, std::mt19937* random) {
    std::uniform_real_distribution<double> share(0.05, 0.95), power(-1.0, 3.0), any(0.0, 1.0);
    for (int i = 0; i < n; ++i) tracks.push_back({share(*random), share(*random)});
    ratio = Eigen::MatrixXd::Zero(n, m);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < m; ++j)
        if (any(*random) < in_gate) ratio(i, j) = std::pow(10.0, power(*random));
  }
};

TEST(TrackAssociation, IsExactForOneTrackOrOneMeasurement) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const bool one_track = trial % 2 == 0;
    const Draw draw(one_track ? 1 : 4, one_track ? 4 : 1, 0.8, &random);
    const Enumeration exact(draw.tracks, draw.ratio);
    const auto found = Associate(draw.tracks, draw.ratio);
    EXPECT_LT((found.probability - exact.pair).cwiseAbs().maxCoeff(), 1e-5) << trial;
    EXPECT_LT((found.existence - exact.existence).cwiseAbs().maxCoeff(), 1e-5) << trial;
    EXPECT_LT((found.fresh - exact.fresh).cwiseAbs().maxCoeff(), 1e-5) << trial;
  }
}

/// Belief propagation is approximate where tracks share measurements, and not far off.
TEST(TrackAssociation, IsNearTheSumOverAllEvents) {
  std::mt19937 random(2);
  double sum = 0.0, worst = 0.0;
  int n = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Draw draw(1 + trial % 4, 1 + trial / 4 % 4, 0.6, &random);
    const Enumeration exact(draw.tracks, draw.ratio);
    const auto found = Associate(draw.tracks, draw.ratio);
    const double error = (found.probability - exact.pair).cwiseAbs().maxCoeff();
    sum += error, ++n;
    worst = std::max(worst, error);
    EXPECT_NEAR(found.probability.rowwise().sum().maxCoeff(), 1.0, 1e-9);
    EXPECT_GE(found.probability.minCoeff(), 0.0);
  }
  EXPECT_LT(sum / n, 0.03);
  EXPECT_LT(worst, 0.25);
}

TEST(TrackAssociation, AMissCountsByWhatWasToBeExpected) {
  const Eigen::MatrixXd none(1, 0);
  EXPECT_NEAR(Associate({{0.9, 0.0}}, none).existence[0], 0.9, 1e-6);
  EXPECT_LT(Associate({{0.9, 0.9}}, none).existence[0], 0.5);
  double before = 0.9;
  for (double detection = 0.1; detection < 1.0; detection += 0.1) {
    const double after = Associate({{0.9, detection}}, none).existence[0];
    EXPECT_LT(after, before);
    before = after;
  }
}

TEST(TrackAssociation, WhatAnotherTrackExplainsBetterIsNotEvidence) {
  const Eigen::MatrixXd shared = (Eigen::MatrixXd(2, 1) << 1000.0, 10.0).finished();
  const auto found = Associate({{0.9, 0.9}, {0.5, 0.9}}, shared);
  EXPECT_GT(found.existence[0], 0.98);
  EXPECT_LT(found.existence[1], 0.2);
  EXPECT_EQ(Assign(found, 0.3), (std::vector<int>{0, -1}));
}

TEST(TrackAssociation, NothingIsAPossibleInput) {
  const auto empty = Associate({}, Eigen::MatrixXd(0, 3));
  EXPECT_EQ(empty.fresh, Eigen::VectorXd::Ones(3));
  EXPECT_TRUE(Assign(empty, 0.5).empty());
  const auto certain = Associate({{1.0, 1.0}}, Eigen::MatrixXd(1, 0));
  EXPECT_TRUE(certain.existence.allFinite());
}

TEST(TrackAssociation, ExistenceFadesWithItsLifetime) {
  double existence = 1.0;
  for (int i = 0; i < 40; ++i) existence = Survival(existence, 0.1, 4.0);
  EXPECT_NEAR(existence, std::exp(-1.0), 1e-9);
}

}  // namespace
}  // namespace chase::track
