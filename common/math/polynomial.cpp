#include "common/math/polynomial.h"

#include <algorithm>
#include <cmath>

namespace chase::math {
namespace {

// The chain p0 = p, p1 = p', p(i+1) = -rem(p(i-1), p(i)), every member scaled to largest
// coefficient 1.
struct SturmChain {
  Polynomial members[33];
  int size = 0;
};

void Normalise(Polynomial* p) {
  const double scale = p->cwiseAbs().maxCoeff();
  if (scale > 0.0) *p /= scale;
}

void Trim(Polynomial* p, double threshold) {
  int n = static_cast<int>(p->size());
  while (n > 1 && std::abs((*p)[n - 1]) <= threshold) --n;
  p->conservativeResize(n);
}

Polynomial Remainder(Polynomial r, const Polynomial& divisor) {
  const int d = static_cast<int>(divisor.size()) - 1;
  for (int k = static_cast<int>(r.size()) - 1; k >= d; --k) {
    const double q = r[k] / divisor[d];
    for (int j = 0; j <= d; ++j) r[k - d + j] -= q * divisor[j];
  }
  return r.head(std::max(d, 1));
}

SturmChain MakeChain(const Polynomial& p, double tolerance) {
  SturmChain chain;
  Polynomial first = p;
  Normalise(&first);
  Trim(&first, tolerance);
  chain.members[chain.size++] = first;
  if (first.size() == 1) return chain;
  Polynomial next = Derivative(first);
  Normalise(&next);
  chain.members[chain.size++] = next;
  while (next.size() > 1) {
    Polynomial rest = -Remainder(chain.members[chain.size - 2], next);
    Trim(&rest, tolerance);
    if (rest.cwiseAbs().maxCoeff() <= tolerance) break;
    Normalise(&rest);
    chain.members[chain.size++] = rest;
    next = rest;
  }
  return chain;
}

int SignChanges(const SturmChain& chain, double t) {
  int changes = 0;
  int last = 0;
  for (int i = 0; i < chain.size; ++i) {
    const double value = Evaluate(chain.members[i], t);
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
  const SturmChain chain = MakeChain(p, tolerance);
  return SignChanges(chain, lower) - SignChanges(chain, upper);
}

double Binomial(int n, int k) {
  static const BinomialTable table;
  if (k < 0 || k > n) return 0.0;
  return n < kTableSize ? table.value[n][k] : ComputeBinomial(n, k);
}

}  // namespace chase::math
