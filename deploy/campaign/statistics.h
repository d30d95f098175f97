#pragma once

#include <optional>
#include <vector>

namespace chase::campaign {

struct Interval {
  double low = 0.0, high = 0.0;
};

/// The score interval of a share, k of n, at 95 %. Wilson, JASA 1927. All of [0, 1] when n is 0.
Interval Wilson(long k, long n);

/// A two-sided test: its p-value, and the least p-value that its counts alone would have allowed.
struct TestResult {
  double p = 1.0, least_p = 1.0;
};

/// Exact McNemar test, which is the sign test of the discordant pairs: `better` of one kind,
/// `worse` of the other.
TestResult McNemar(long better, long worse);

/// Fisher's exact test of k1 of n1 against k2 of n2: the sum of all tables with the same margins
/// that are no likelier than this one.
TestResult Fisher(long k1, long n1, long k2, long n2);

/// Exact test of a mean of zero that flips the signs of the differences (Fisher 1935, section 21):
/// the share of all sign patterns whose sum is as far from zero. Above 16 differences that are not
/// zero, of 20,000 patterns of a fixed sequence.
TestResult SignFlip(const std::vector<double>& differences);

/// Welch's t-test of two means. Too few to tell: p = least_p = 1.
TestResult Welch(const std::vector<double>& a, const std::vector<double>& b);

/// Mean of the values with the t interval at 95 %; none with fewer than two.
struct Mean {
  double mean = 0.0;
  std::optional<Interval> interval;
};
Mean MeanOf(const std::vector<double>& values);
/// Mean of b minus mean of a, with Welch's interval.
Mean DifferenceOf(const std::vector<double>& a, const std::vector<double>& b);

/// Nearest-rank quantile, q in (0, 1]; none of nothing.
std::optional<double> Quantile(std::vector<double> values, double q);

/// Holm's adjusted p-values (Scandinavian Journal of Statistics 1979). Tests that could not reach
/// `level` whatever their outcome do not count in the family and get 1 (Tarone, Biometrics 1990).
std::vector<double> Holm(const std::vector<TestResult>& tests, double level);

}  // namespace chase::campaign
