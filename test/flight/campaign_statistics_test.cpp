#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "deploy/campaign/statistics.h"

namespace chase::campaign {
namespace {

double Choose(long n, long k) {
  double c = 1.0;
  for (long i = 1; i <= k; ++i) c = c * static_cast<double>(n - k + i) / static_cast<double>(i);
  return c;
}

/// Share of all patterns of n fair coins that are as uneven as `heads`, one by one.
double BruteMcNemar(long better, long worse) {
  const long n = better + worse;
  long as_far = 0;
  for (long pattern = 0; pattern < (1L << n); ++pattern) {
    const long heads = __builtin_popcountl(static_cast<unsigned long>(pattern));
    if (std::abs(2 * heads - n) >= std::abs(better - worse)) ++as_far;
  }
  return static_cast<double>(as_far) / static_cast<double>(1L << n);
}

/// Deals k marks to n1 + n2 flights in every way: the weight of the tables that are no likelier.
double BruteFisher(long k1, long n1, long k2, long n2) {
  const long n = n1 + n2, k = k1 + k2;
  std::vector<double> ways(static_cast<size_t>(n1) + 1, 0.0);
  for (long pattern = 0; pattern < (1L << n); ++pattern) {
    const auto bits = static_cast<unsigned long>(pattern);
    if (__builtin_popcountl(bits) != k) continue;
    ways[static_cast<size_t>(__builtin_popcountl(bits & ((1ul << n1) - 1)))] += 1.0;
  }
  double sum = 0.0;
  for (const double w : ways)
    if (w <= ways[static_cast<size_t>(k1)]) sum += w;
  return sum / Choose(n, k);
}

TEST(McNemar, IsTheShareOfAllPatterns) {
  for (long better = 0; better <= 9; ++better)
    for (long worse = 0; worse <= 9; ++worse) {
      const TestResult test = McNemar(better, worse);
      EXPECT_NEAR(test.p, BruteMcNemar(better, worse), 1e-12) << better << " " << worse;
      const double least = BruteMcNemar(better + worse, 0);
      EXPECT_NEAR(test.least_p, least, 1e-12) << better << " " << worse;
    }
  EXPECT_GT(McNemar(600, 500).p, 0.0);
  EXPECT_LT(McNemar(600, 500).p, 0.005);
}

TEST(Fisher, IsTheShareOfAllDeals) {
  for (long n1 = 1; n1 <= 7; ++n1)
    for (long n2 = 1; n2 <= 6; ++n2)
      for (long k1 = 0; k1 <= n1; ++k1)
        for (long k2 = 0; k2 <= n2; ++k2) {
          const TestResult test = Fisher(k1, n1, k2, n2);
          EXPECT_NEAR(test.p, BruteFisher(k1, n1, k2, n2), 1e-12)
              << k1 << "/" << n1 << " " << k2 << "/" << n2;
          double least = 1.0;
          for (long i = std::max(0L, k1 + k2 - n2); i <= std::min(n1, k1 + k2); ++i)
            least = std::min(least, BruteFisher(i, n1, k1 + k2 - i, n2));
          EXPECT_NEAR(test.least_p, least, 1e-12);
        }
  EXPECT_NEAR(Fisher(3, 4, 1, 4).p, 0.4857, 1e-4);  // Fisher's lady tasting tea
}

/// Bounds of the score test by definition: the shares that k of n does not refuse.
TEST(Wilson, HoldsTheSharesThatTheScoreTestDoesNotRefuse) {
  const double z = 1.959963984540054;
  for (long n = 1; n <= 40; ++n)
    for (long k = 0; k <= n; ++k) {
      const Interval interval = Wilson(k, n);
      const double share = static_cast<double>(k) / static_cast<double>(n);
      for (int i = 1; i < 1000; ++i) {
        const double p = i / 1000.0;
        const double score =
            std::abs(share - p) / std::sqrt(p * (1.0 - p) / static_cast<double>(n));
        if (std::abs(score - z) < 1e-6) continue;
        EXPECT_EQ(score < z, interval.low < p && p < interval.high) << k << "/" << n << " " << p;
      }
    }
  EXPECT_EQ(Wilson(0, 5).low, 0.0);
  EXPECT_EQ(Wilson(5, 5).high, 1.0);
  EXPECT_EQ(Wilson(0, 0).high, 1.0);
}

TEST(Wilson, CoversTheTrueShare) {
  for (const double p : {0.5, 0.8, 0.9}) {
    double covered = 0.0;
    const long n = 100;
    for (long k = 0; k <= n; ++k) {
      const Interval interval = Wilson(k, n);
      if (interval.low <= p && p <= interval.high)
        covered += Choose(n, k) * std::pow(p, k) * std::pow(1.0 - p, n - k);
    }
    EXPECT_NEAR(covered, 0.95, 0.02) << p;
  }
}

std::vector<double> Normal(std::mt19937* rng, size_t n, double mean) {
  std::normal_distribution<double> normal(mean, 1.0);
  std::vector<double> values(n);
  for (double& v : values) v = normal(*rng);
  return values;
}

double BruteSignFlip(const std::vector<double>& d) {
  long as_far = 0;
  const double seen = std::abs(std::accumulate(d.begin(), d.end(), 0.0));
  for (long pattern = 0; pattern < (1L << d.size()); ++pattern) {
    double sum = 0.0;
    for (size_t i = 0; i < d.size(); ++i) sum += (pattern >> i & 1L) ? d[i] : -d[i];
    if (std::abs(sum) >= seen - 1e-12) ++as_far;
  }
  return static_cast<double>(as_far) / static_cast<double>(1L << d.size());
}

TEST(SignFlip, IsTheShareOfAllPatterns) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    std::mt19937 rng(seed);
    const auto d = Normal(&rng, 1 + seed % 12, 0.5);
    EXPECT_NEAR(SignFlip(d).p, BruteSignFlip(d), 1e-12) << "seed " << seed;
  }
}

TEST(SignFlip, ManyDifferencesAreDrawn) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    std::mt19937 rng(seed);
    const auto d = Normal(&rng, 18, 0.4);
    EXPECT_NEAR(SignFlip(d).p, BruteSignFlip(d), 0.015) << "seed " << seed;
    EXPECT_EQ(SignFlip(d).p, SignFlip(d).p);
  }
  EXPECT_LT(SignFlip(std::vector<double>(200, 0.1)).p, 1e-4);
}

TEST(SignFlip, EqualFlightsTellNothing) {
  EXPECT_EQ(SignFlip({}).p, 1.0);
  EXPECT_EQ(SignFlip({0.0, 0.0, 0.0}).p, 1.0);
  EXPECT_EQ(SignFlip({0.0, 0.0, -0.3}).p, 1.0);
  EXPECT_EQ(SignFlip({0.0, 0.0, -0.3}).least_p, 1.0);
  EXPECT_EQ(SignFlip(std::vector<double>(6, 0.2)).p, 2.0 / 64.0);
}

/// Under no difference a test refuses 5 % of the time and an interval misses as often.
TEST(Welch, RefusesAsOftenAsItSays) {
  std::mt19937 rng(7);
  int refused = 0, missed = 0, missed_mean = 0;
  const int n = 4000;
  for (int i = 0; i < n; ++i) {
    const auto a = Normal(&rng, 9, 2.0), b = Normal(&rng, 14, 2.0);
    const Interval interval = *DifferenceOf(a, b).interval;
    refused += Welch(a, b).p < 0.05;
    missed += interval.low > 0.0 || interval.high < 0.0;
    const Interval mean = *MeanOf(a).interval;
    missed_mean += mean.low > 2.0 || mean.high < 2.0;
  }
  EXPECT_EQ(refused, missed);
  EXPECT_NEAR(refused, 0.05 * n, 3.0 * std::sqrt(0.05 * 0.95 * n)) << "seed 7";
  EXPECT_NEAR(missed_mean, 0.05 * n, 3.0 * std::sqrt(0.05 * 0.95 * n)) << "seed 7";
}

TEST(Mean, TooFewHaveNoInterval) {
  EXPECT_FALSE(MeanOf({}).interval);
  EXPECT_FALSE(MeanOf({1.0}).interval);
  EXPECT_FALSE(DifferenceOf({1.0}, {2.0, 3.0}).interval);
  EXPECT_EQ(DifferenceOf({1.0}, {2.0, 3.0}).mean, 1.5);
  EXPECT_EQ(Welch({1.0, 1.0}, {2.0, 2.0}).p, 1.0);
}

/// The step-down procedure by its definition: refuse while p(i) < level / (m - i).
std::vector<bool> BruteHolm(const std::vector<double>& p, double level) {
  std::vector<bool> refused(p.size(), false);
  for (size_t left = p.size(); left > 0; --left) {
    size_t least = p.size();
    for (size_t i = 0; i < p.size(); ++i)
      if (!refused[i] && (least == p.size() || p[i] < p[least])) least = i;
    if (p[least] * static_cast<double>(left) >= level) break;
    refused[least] = true;
  }
  return refused;
}

TEST(Holm, RefusesWhatTheStepsRefuse) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (unsigned seed = 1; seed <= 500; ++seed) {
    std::mt19937 rng(seed);
    std::vector<double> p(1 + seed % 8);
    for (double& value : p) value = std::pow(uniform(rng), 3.0);
    std::vector<TestResult> tests;
    for (const double value : p) tests.push_back({value, 0.0});
    const auto adjusted = Holm(tests, 0.05);
    const auto refused = BruteHolm(p, 0.05);
    for (size_t i = 0; i < p.size(); ++i)
      EXPECT_EQ(adjusted[i] < 0.05, refused[i]) << "seed " << seed;
  }
}

TEST(Holm, TestsThatCannotRefuseDoNotCount) {
  const std::vector<TestResult> tests = {{0.03, 0.001}, {0.5, 0.25}, {1.0, 1.0}};
  const auto adjusted = Holm(tests, 0.05);
  EXPECT_DOUBLE_EQ(adjusted[0], 0.03);
  EXPECT_EQ(adjusted[1], 1.0);
  EXPECT_EQ(adjusted[2], 1.0);
}

TEST(Quantile, IsTheNearestRank) {
  std::vector<double> values(20);
  std::iota(values.begin(), values.end(), 1.0);
  std::reverse(values.begin(), values.end());
  EXPECT_EQ(Quantile(values, 0.95), 19.0);
  EXPECT_EQ(Quantile(values, 0.91), 19.0);
  EXPECT_EQ(Quantile(values, 1.0), 20.0);
  EXPECT_EQ(Quantile({3.0}, 0.95), 3.0);
  EXPECT_FALSE(Quantile({}, 0.95));
}

}  // namespace
}  // namespace chase::campaign
