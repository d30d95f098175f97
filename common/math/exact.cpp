#include "common/math/exact.h"

#include <algorithm>
#include <cmath>

#include "common/math/bernstein.h"

namespace chase::math {
namespace {

using Integer = ExactPolynomial::Integer;
using Integers = std::vector<Integer>;

int Sign(const Integer& x) { return x.sign(); }

void Trim(Integers* p) {
  while (!p->empty() && p->back() == 0) p->pop_back();
}

// Divides by the greatest common divisor of the coefficients; signs stay.
void MakePrimitive(Integers* p) {
  Integer content = 0;
  for (const Integer& x : *p) {
    content = gcd(content, x);
    if (content == 1) return;
  }
  if (content > 1)
    for (Integer& x : *p) x /= content;
}

Integers Derivative(const Integers& p) {
  Integers d;
  for (size_t k = 1; k < p.size(); ++k) d.push_back(p[k] * static_cast<int>(k));
  return d;
}

Integers Multiply(const Integers& a, const Integers& b) {
  if (a.empty() || b.empty()) return {};
  Integers r(a.size() + b.size() - 1, Integer(0));
  for (size_t i = 0; i < a.size(); ++i)
    for (size_t j = 0; j < b.size(); ++j) r[i + j] += a[i] * b[j];
  return r;
}

int Degree(const Integers& p) { return static_cast<int>(p.size()) - 1; }

// |lead(b)|^max(deg r - deg b + 1, 0) r modulo b: a positive multiple of the remainder.
Integers Remainder(Integers r, const Integers& b) {
  const Integer lead = abs(b.back());
  for (int steps = Degree(r) - Degree(b) + 1; steps > 0; --steps) {
    const bool reduces = r.size() >= b.size();
    const Integer factor = !reduces ? Integer(0) : b.back() > 0 ? r.back() : Integer(-r.back());
    for (Integer& x : r) x *= lead;
    if (!reduces) continue;
    const size_t shift = r.size() - b.size();
    for (size_t j = 0; j < b.size(); ++j) r[shift + j] -= factor * b[j];
    Trim(&r);
  }
  return r;
}

// The signed remainder sequence of first and second (of lower degree), down to their greatest
// common divisor, up to positive factors. Those are kept small by the divisors of the subresultant
// algorithm (Collins 1967, Brown 1971), which divide exactly.
std::vector<Integers> Chain(Integers first, Integers second) {
  MakePrimitive(&first);
  MakePrimitive(&second);
  std::vector<Integers> chain = {std::move(first)};
  Integer g = 1, h = 1;
  while (!second.empty()) {
    chain.push_back(std::move(second));
    const Integers& a = chain[chain.size() - 2];
    const Integers& b = chain.back();
    const unsigned delta = static_cast<unsigned>(Degree(a) - Degree(b));
    second = Remainder(a, b);
    const Integer divisor = -g * pow(h, delta);
    for (Integer& x : second) x /= divisor;
    g = abs(b.back());
    h = delta == 0 ? h : Integer(pow(g, delta) / pow(h, delta - 1));
  }
  return chain;
}

Integer ValueAtOne(const Integers& p) {
  Integer sum = 0;
  for (const Integer& x : p) sum += x;
  return sum;
}

int SignChanges(const std::vector<Integers>& chain, bool at_one) {
  int changes = 0;
  int last = 0;
  for (const Integers& p : chain) {
    const int sign = at_one ? Sign(ValueAtOne(p)) : Sign(p[0]);
    if (sign == 0) continue;
    changes += last != 0 && sign != last;
    last = sign;
  }
  return changes;
}

int Variation(const std::vector<Integers>& chain) {
  return SignChanges(chain, false) - SignChanges(chain, true);
}

// Sum over the distinct roots of p in (0,1) of the sign of q there (Tarski query). p(0), p(1) != 0.
int TarskiQuery(const Integers& p, const Integers& q) {
  return Variation(Chain(p, Remainder(Multiply(Derivative(p), q), p)));
}

// Takes out the factors t^a and (1-t)^b, which are positive inside (0,1).
Integers WithoutEndRoots(Integers p) {
  Trim(&p);
  while (!p.empty() && p[0] == 0) p.erase(p.begin());
  while (!p.empty() && ValueAtOne(p) == 0) {
    // p = (1-t) r: r_0 = p_0, r_k = p_k + r_(k-1).
    for (size_t k = 1; k < p.size(); ++k) p[k] += p[k - 1];
    p.pop_back();
  }
  return p;
}

// n! times the Bernstein coefficients of degree n of the polynomial (of lower or equal degree).
Integers ScaledBernstein(const Integers& p, int n) {
  std::vector<Integer> factorial = {1};
  for (int k = 1; k <= n; ++k) factorial.push_back(factorial.back() * k);
  const auto choose = [&](int a, int b) {
    return Integer(factorial[static_cast<size_t>(a)] /
                   (factorial[static_cast<size_t>(b)] * factorial[static_cast<size_t>(a - b)]));
  };
  Integers b(static_cast<size_t>(n) + 1, Integer(0));
  for (int j = 0; j <= n; ++j)
    for (int k = 0; k <= std::min(j, Degree(p)); ++k)
      b[static_cast<size_t>(j)] += p[static_cast<size_t>(k)] * choose(j, k) *
                                   (factorial[static_cast<size_t>(n)] / choose(n, k));
  return b;
}

// 2^n times the Bernstein coefficients of both halves.
void Halve(const Integers& b, Integers* left, Integers* right) {
  *right = b;
  left->assign(b.size(), Integer(0));
  const size_t n = b.size() - 1;
  for (size_t k = 0; k <= n; ++k) {
    for (size_t i = 0; k > 0 && i <= n - k; ++i) (*right)[i] += (*right)[i + 1];
    (*left)[k] = (*right)[0] << static_cast<unsigned>(n - k);
  }
  for (size_t i = 0; i <= n; ++i) (*right)[i] <<= static_cast<unsigned>(i);
}

// P, Q, S to a common scale in Bernstein form, P and Q positive everywhere.
Positivity DecideSight(const Integers& P, const Integers& Q, const Integers& S, int depth) {
  const Integer s = *std::min_element(S.begin(), S.end());
  if (s > 0) return Positivity::kPositive;
  const Integer p = *std::min_element(P.begin(), P.end());
  const Integer q = *std::min_element(Q.begin(), Q.end());
  if (p > 0 && q > 0 && p * q > s * s) return Positivity::kPositive;
  for (size_t e : {size_t{0}, P.size() - 1})
    if (S[e] <= 0 && P[e] * Q[e] <= S[e] * S[e]) return Positivity::kNotPositive;
  if (depth == 0) return Positivity::kUndecided;
  Integers halves[2][3];
  Halve(P, &halves[0][0], &halves[1][0]);
  Halve(Q, &halves[0][1], &halves[1][1]);
  Halve(S, &halves[0][2], &halves[1][2]);
  const Positivity first = DecideSight(halves[0][0], halves[0][1], halves[0][2], depth - 1);
  if (first != Positivity::kPositive) return first;
  return DecideSight(halves[1][0], halves[1][1], halves[1][2], depth - 1);
}

Integers Scaled(const ExactPolynomial& p, int exponent) {
  Integers r = p.c;
  for (Integer& x : r) x <<= static_cast<unsigned>(p.exponent - exponent);
  return r;
}

ExactPolynomial Combine(const ExactPolynomial& a, const ExactPolynomial& b, int sign) {
  if (b.c.empty()) return a;
  ExactPolynomial r;
  r.exponent = a.c.empty() ? b.exponent : std::min(a.exponent, b.exponent);
  r.c = a.c.empty() ? Integers() : Scaled(a, r.exponent);
  const Integers other = Scaled(b, r.exponent);
  r.c.resize(std::max(r.c.size(), other.size()), Integer(0));
  for (size_t k = 0; k < other.size(); ++k) r.c[k] += sign * other[k];
  return r;
}

Positivity DecideSightBySubdivision(const ExactPolynomial& P, const ExactPolynomial& Q,
                                    const ExactPolynomial& S) {
  constexpr int kDepth = 24;
  const int exponent = S.c.empty() ? std::min(P.exponent, Q.exponent)
                                   : std::min({P.exponent, Q.exponent, S.exponent});
  const size_t n = std::max({P.c.size(), Q.c.size(), S.c.size()}) - 1;
  const auto bernstein = [&](const ExactPolynomial& p) {
    return ScaledBernstein(Scaled(p, exponent), static_cast<int>(n));
  };
  return DecideSight(bernstein(P), bernstein(Q), bernstein(S), kDepth);
}

}  // namespace

ExactPolynomial MakeExact(const Polynomial& p) {
  ExactPolynomial r;
  for (Eigen::Index k = 0; k < p.size(); ++k) {
    if (p[k] == 0.0) continue;
    int e = 0;
    std::frexp(p[k], &e);
    r.exponent = r.c.empty() ? e - 53 : std::min(r.exponent, e - 53);
    r.c.resize(1);
  }
  if (r.c.empty()) return r;
  r.c.assign(static_cast<size_t>(p.size()), Integer(0));
  for (Eigen::Index k = 0; k < p.size(); ++k) {
    int e = 0;
    const double mantissa = std::frexp(p[k], &e);
    Integer x = static_cast<long long>(std::ldexp(mantissa, 53));
    if (x != 0) r.c[static_cast<size_t>(k)] = x << static_cast<unsigned>(e - 53 - r.exponent);
  }
  return r;
}

ExactPolynomial MakeExact(double value) { return MakeExact(Polynomial::Constant(1, value)); }

ExactPolynomial operator+(const ExactPolynomial& a, const ExactPolynomial& b) {
  return Combine(a, b, 1);
}
ExactPolynomial operator-(const ExactPolynomial& a, const ExactPolynomial& b) {
  return Combine(a, b, -1);
}
ExactPolynomial operator*(const ExactPolynomial& a, const ExactPolynomial& b) {
  return {Multiply(a.c, b.c), a.exponent + b.exponent};
}

int SignAtZero(const ExactPolynomial& p) { return p.c.empty() ? 0 : Sign(p.c[0]); }
int SignAtOne(const ExactPolynomial& p) { return Sign(ValueAtOne(p.c)); }

int CountRootsExact(const ExactPolynomial& p) {
  Integers c = p.c;
  Trim(&c);
  if (c.empty()) return -1;
  const bool root_at_one = ValueAtOne(c) == 0;
  c = WithoutEndRoots(std::move(c));
  return (root_at_one ? 1 : 0) + Variation(Chain(c, Derivative(c)));
}

int CountRootsExact(const Polynomial& p) { return CountRootsExact(MakeExact(p)); }

bool IsPositiveExact(const ExactPolynomial& p) {
  return SignAtZero(p) > 0 && SignAtOne(p) > 0 && CountRootsExact(p) == 0;
}

bool IsPositive(const Polynomial& p) {
  if (p.size() == 0 || !p.allFinite()) return false;
  const Positivity filtered = DecidePositive(PowerToBernstein(p), PowerToBernsteinError(p), 20);
  if (filtered != Positivity::kUndecided) return filtered == Positivity::kPositive;
  return IsPositiveExact(MakeExact(p));
}

bool IsSightClearExact(const ExactPolynomial& P, const ExactPolynomial& Q,
                       const ExactPolynomial& S) {
  if (!IsPositiveExact(P) || !IsPositiveExact(Q)) return false;
  const Positivity decided = DecideSightBySubdivision(P, Q, S);
  if (decided != Positivity::kUndecided) return decided == Positivity::kPositive;
  const ExactPolynomial W = P * Q - S * S;
  if (SignAtZero(S) <= 0 && SignAtZero(W) <= 0) return false;
  if (SignAtOne(S) <= 0 && SignAtOne(W) <= 0) return false;
  // Subdivision does not end where S < 0 and P Q touches S^2. The set { S <= 0, W <= 0 } is closed
  // and, W being P Q > 0 where S = 0, starts at a root of W with S < 0. It is empty when S > 0 at
  // every root of W inside.
  const Integers inside = WithoutEndRoots(W.c);
  if (inside.empty()) return true;  // W = 0: S = +-sqrt(PQ) keeps its sign, positive at 0
  Integers s = S.c;
  Trim(&s);
  if (s.empty()) return true;  // S = 0: W = P Q
  return TarskiQuery(inside, s) == TarskiQuery(inside, {Integer(1)});
}

}  // namespace chase::math
