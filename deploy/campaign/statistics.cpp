#include "deploy/campaign/statistics.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace chase::campaign {
namespace {

constexpr double kConfidence = 0.95;
/// Rounding when probabilities or sums that are equal by mathematics are compared.
constexpr double kEqual = 1.0 + 1e-9;

double LogChoose(long n, long k) {
  const auto f = [](long m) { return std::lgamma(static_cast<double>(m) + 1.0); };
  return f(n) - f(k) - f(n - k);
}

double MeanValue(const std::vector<double>& v) {
  return std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
}

/// Variance of the mean of the values.
double MeanVariance(const std::vector<double>& v) {
  const double mean = MeanValue(v);
  double sum = 0.0;
  for (const double x : v) sum += (x - mean) * (x - mean);
  const auto n = static_cast<double>(v.size());
  return sum / (n - 1.0) / n;
}

Interval Around(double mean, double variance, double freedom) {
  const boost::math::students_t t(freedom);
  const double half = boost::math::quantile(t, 0.5 + 0.5 * kConfidence) * std::sqrt(variance);
  return {mean - half, mean + half};
}

/// Welch and Satterthwaite's degrees of freedom.
double Freedom(double va, double na, double vb, double nb) {
  return (va + vb) * (va + vb) / (va * va / (na - 1.0) + vb * vb / (nb - 1.0));
}

/// splitmix64: a fixed sequence of 64 sign bits each.
uint64_t NextBits(uint64_t* state) {
  uint64_t z = (*state += 0x9e3779b97f4a7c15ull);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

double FlippedSum(const std::vector<double>& values, uint64_t pattern) {
  double sum = 0.0;
  for (size_t i = 0; i < values.size(); ++i) sum += (pattern >> i & 1u) ? -values[i] : values[i];
  return sum;
}

TestResult FlipAll(const std::vector<double>& values, double limit) {
  const uint64_t patterns = uint64_t{1} << values.size();
  uint64_t as_far = 0;
  for (uint64_t pattern = 0; pattern < patterns; ++pattern)
    if (std::abs(FlippedSum(values, pattern)) * kEqual >= limit) ++as_far;
  const auto all = static_cast<double>(patterns);
  return {static_cast<double>(as_far) / all, std::min(1.0, 2.0 / all)};
}

TestResult FlipSome(const std::vector<double>& values, double limit) {
  constexpr int kPatterns = 20000;
  uint64_t state = 1;
  int as_far = 1;  // the pattern that was seen counts
  for (int i = 0; i < kPatterns; ++i) {
    double sum = 0.0;
    uint64_t bits = 0;
    for (size_t k = 0; k < values.size(); ++k, bits >>= 1) {
      if (k % 64 == 0) bits = NextBits(&state);
      sum += (bits & 1u) ? -values[k] : values[k];
    }
    if (std::abs(sum) * kEqual >= limit) ++as_far;
  }
  return {as_far / (kPatterns + 1.0), 1.0 / (kPatterns + 1.0)};
}

}  // namespace

Interval Wilson(long k, long n) {
  if (n <= 0) return {0.0, 1.0};
  constexpr double kZ = 1.959963984540054;  // 97.5 % quantile of the standard normal
  const auto m = static_cast<double>(n);
  const double share = static_cast<double>(k) / m, z2 = kZ * kZ / m;
  const double center = (share + 0.5 * z2) / (1.0 + z2);
  const double half = kZ * std::sqrt((share * (1.0 - share) + 0.25 * z2) / m) / (1.0 + z2);
  return {k == 0 ? 0.0 : center - half, k == n ? 1.0 : center + half};
}

TestResult McNemar(long better, long worse) {
  const long n = better + worse;
  if (n == 0) return {};
  double tail = 0.0;
  for (long i = 0; i <= std::min(better, worse); ++i)
    tail += std::exp(LogChoose(n, i) - static_cast<double>(n) * std::log(2.0));
  return {std::min(1.0, 2.0 * tail), std::min(1.0, 2.0 * std::exp2(-static_cast<double>(n)))};
}

TestResult Fisher(long k1, long n1, long k2, long n2) {
  const long k = k1 + k2;
  const auto probability = [&](long i) {
    return std::exp(LogChoose(n1, i) + LogChoose(n2, k - i) - LogChoose(n1 + n2, k));
  };
  const long first = std::max(0L, k - n2), last = std::min(n1, k);
  const auto no_likelier_than = [&](double limit) {
    double sum = 0.0;
    for (long i = first; i <= last; ++i)
      if (const double p = probability(i); p <= limit * kEqual) sum += p;
    return std::min(1.0, sum);
  };
  // The distribution has one peak, so that its least likely table is at an end.
  return {no_likelier_than(probability(k1)),
          no_likelier_than(std::min(probability(first), probability(last)))};
}

TestResult SignFlip(const std::vector<double>& differences) {
  std::vector<double> values;
  for (const double d : differences)
    if (d != 0.0) values.push_back(d);
  if (values.empty()) return {};
  const double limit = std::abs(std::accumulate(values.begin(), values.end(), 0.0));
  constexpr size_t kExact = 16;
  return values.size() <= kExact ? FlipAll(values, limit) : FlipSome(values, limit);
}

TestResult Welch(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() < 2 || b.size() < 2) return {};
  const double va = MeanVariance(a), vb = MeanVariance(b);
  if (!(va + vb > 0.0)) return {};
  const double t = std::abs(MeanValue(b) - MeanValue(a)) / std::sqrt(va + vb);
  const boost::math::students_t distribution(
      Freedom(va, static_cast<double>(a.size()), vb, static_cast<double>(b.size())));
  return {2.0 * boost::math::cdf(boost::math::complement(distribution, t)), 0.0};
}

Mean MeanOf(const std::vector<double>& values) {
  Mean out;
  if (values.empty()) return out;
  out.mean = MeanValue(values);
  if (values.size() < 2) return out;
  out.interval = Around(out.mean, MeanVariance(values), static_cast<double>(values.size()) - 1.0);
  return out;
}

Mean DifferenceOf(const std::vector<double>& a, const std::vector<double>& b) {
  Mean out;
  if (a.empty() || b.empty()) return out;
  out.mean = MeanValue(b) - MeanValue(a);
  if (a.size() < 2 || b.size() < 2) return out;
  const double va = MeanVariance(a), vb = MeanVariance(b);
  const double freedom =
      va + vb > 0.0 ? Freedom(va, static_cast<double>(a.size()), vb, static_cast<double>(b.size()))
                    : 1.0;
  out.interval = Around(out.mean, va + vb, freedom);
  return out;
}

std::optional<double> Quantile(std::vector<double> values, double q) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const double rank = std::ceil(q * static_cast<double>(values.size()));
  return values[static_cast<size_t>(std::max(rank, 1.0)) - 1];
}

std::vector<double> Holm(const std::vector<TestResult>& tests, double level) {
  std::vector<size_t> order;
  for (size_t i = 0; i < tests.size(); ++i)
    if (tests[i].least_p < level) order.push_back(i);
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t i, size_t j) { return tests[i].p < tests[j].p; });
  std::vector<double> adjusted(tests.size(), 1.0);
  double greatest = 0.0;
  for (size_t rank = 0; rank < order.size(); ++rank) {
    const double p = static_cast<double>(order.size() - rank) * tests[order[rank]].p;
    greatest = std::max(greatest, std::min(1.0, p));
    adjusted[order[rank]] = greatest;
  }
  return adjusted;
}

}  // namespace chase::campaign
