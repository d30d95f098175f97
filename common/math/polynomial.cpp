#include "common/math/polynomial.h"

#include <algorithm>
#include <cmath>

namespace chase::math {
namespace {

constexpr int kMaxTerms = Polynomial::MaxRowsAtCompileTime;

// The chain p0 = p, p1 = p', p(i+1) = -rem(p(i-1), p(i)), every member scaled to largest
// coefficient 1. On the stack and never copied: a chain is made in place.
struct SturmChain {
  double c[kMaxTerms + 1][kMaxTerms];
  int degree[kMaxTerms + 1];
  int size = 0;
};

// Largest magnitude; odd and even ones apart, for two comparisons at a time.
double Largest(const double* c, int degree) {
  double even = std::abs(c[0]), odd = 0.0;
  for (int i = 1; i < degree; i += 2) {
    odd = std::max(odd, std::abs(c[i]));
    even = std::max(even, std::abs(c[i + 1]));
  }
  return degree % 2 == 1 ? std::max({even, odd, std::abs(c[degree])}) : std::max(even, odd);
}

void Scale(double* c, int degree) {
  const double scale = Largest(c, degree);
  if (scale > 0.0)
    for (int i = 0; i <= degree; ++i) c[i] /= scale;
}

int Trimmed(const double* c, int degree, double threshold) {
  while (degree > 0 && std::abs(c[degree]) <= threshold) --degree;
  return degree;
}

// r = -rem(p, d) of degree m - 1 at most, m >= 1 the divisor's. The usual step, degrees n = m + 1,
// is written out: both quotients first, then every coefficient in one go.
void NegativeRemainder(const double* p, int n, const double* d, int m, double* r) {
  if (n == m + 1) {
    const double q1 = p[n] / d[m], q0 = (p[m] - q1 * d[m - 1]) / d[m];
    r[0] = -(p[0] - q0 * d[0]);
    for (int i = 1; i < m; ++i) r[i] = -((p[i] - q1 * d[i - 1]) - q0 * d[i]);
    return;
  }
  double rest[kMaxTerms];
  std::copy(p, p + n + 1, rest);
  for (int k = n; k >= m; --k) {
    const double q = rest[k] / d[m];
    for (int j = 0; j <= m; ++j) rest[k - m + j] -= q * d[j];
  }
  for (int i = 0; i < m; ++i) r[i] = -rest[i];
}

void MakeChain(const Polynomial& p, double tolerance, SturmChain* chain) {
  int n = static_cast<int>(p.size()) - 1;
  double* first = chain->c[0];
  std::copy(p.data(), p.data() + n + 1, first);
  Scale(first, n);
  n = chain->degree[0] = Trimmed(first, n, tolerance);
  chain->size = 1;
  if (n == 0) return;
  double* slope = chain->c[1];
  for (int i = 0; i < n; ++i) slope[i] = (i + 1) * first[i + 1];
  Scale(slope, n - 1);
  chain->degree[1] = n - 1;
  chain->size = 2;
  for (int i = 2; chain->degree[i - 1] > 0; ++i) {
    double* rest = chain->c[i];
    const int m = chain->degree[i - 1];
    NegativeRemainder(chain->c[i - 2], chain->degree[i - 2], chain->c[i - 1], m, rest);
    const int degree = Trimmed(rest, m - 1, tolerance);
    if (Largest(rest, degree) <= tolerance) return;
    Scale(rest, degree);
    chain->degree[i] = degree;
    chain->size = i + 1;
  }
}

double ValueAt(const double* c, int degree, double t) {
  if (t == 0.0) return c[0];
  double value = c[degree];
  if (t == 1.0)
    for (int k = degree; k-- > 0;) value += c[k];
  else
    for (int k = degree; k-- > 0;) value = value * t + c[k];
  return value;
}

int SignChanges(const SturmChain& chain, double t) {
  int changes = 0, last = 0;
  for (int i = 0; i < chain.size; ++i) {
    const double value = ValueAt(chain.c[i], chain.degree[i], t);
    const int sign = (value > 0.0) - (value < 0.0);
    if (sign == 0) continue;
    changes += last != 0 && sign != last;
    last = sign;
  }
  return changes;
}

double ComputeBinomial(int n, int k) {
  double value = 1.0;
  for (int i = 0; i < k; ++i) value = value * (n - i) / (i + 1);
  return value;
}

constexpr int kTableSize = 33;

struct BinomialTable {
  double value[kTableSize][kTableSize];
  BinomialTable() {
    for (int n = 0; n < kTableSize; ++n)
      for (int k = 0; k < kTableSize; ++k) value[n][k] = k <= n ? ComputeBinomial(n, k) : 0.0;
  }
};

}  // namespace

double Evaluate(const Polynomial& p, double t) {
  double value = 0.0;
  for (Eigen::Index k = p.size(); k-- > 0;) value = value * t + p[k];
  return value;
}

Polynomial Derivative(const Polynomial& p) {
  if (p.size() <= 1) return Polynomial::Zero(1);
  Polynomial d(p.size() - 1);
  for (Eigen::Index k = 0; k < d.size(); ++k) d[k] = static_cast<double>(k + 1) * p[k + 1];
  return d;
}

Polynomial Product(const Polynomial& p, const Polynomial& q) {
  if (p.size() == 0 || q.size() == 0) return Polynomial::Zero(1);
  Polynomial r = Polynomial::Zero(p.size() + q.size() - 1);
  for (Eigen::Index i = 0; i < p.size(); ++i)
    for (Eigen::Index j = 0; j < q.size(); ++j) r[i + j] += p[i] * q[j];
  return r;
}

Polynomial Sum(const Polynomial& p, const Polynomial& q, double scale) {
  Polynomial r = Polynomial::Zero(std::max(p.size(), q.size()));
  r.head(p.size()) = p;
  r.head(q.size()) += scale * q;
  return r;
}

int CountRootsSturm(const Polynomial& p, double lower, double upper, double tolerance) {
  if (p.size() == 0) return 0;
  SturmChain chain;
  MakeChain(p, tolerance, &chain);
  return SignChanges(chain, lower) - SignChanges(chain, upper);
}

double Binomial(int n, int k) {
  static const BinomialTable table;
  if (k < 0 || k > n) return 0.0;
  return n < kTableSize ? table.value[n][k] : ComputeBinomial(n, k);
}

}  // namespace chase::math
