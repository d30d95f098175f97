#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/math/bernstein.h"
#include "common/math/exact.h"
#include "common/math/polynomial.h"

namespace chase::math {
namespace {

std::mt19937_64 Generator(unsigned seed) { return std::mt19937_64(seed); }

double Uniform(std::mt19937_64& g, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(g);
}

Polynomial Random(std::mt19937_64& g, int degree) {
  Polynomial p(degree + 1);
  for (auto& c : p) c = Uniform(g, -1.0, 1.0);
  return p;
}

Polynomial Poly(std::initializer_list<double> c) {
  Polynomial p(static_cast<Eigen::Index>(c.size()));
  std::copy(c.begin(), c.end(), p.data());
  return p;
}

// prod (t - r)
Polynomial FromRoots(const std::vector<double>& roots) {
  Polynomial p = Poly({1.0});
  for (double r : roots) p = Product(p, Poly({-r, 1.0}));
  return p;
}

double MinimumBySampling(const Polynomial& p, int n) {
  double low = Evaluate(p, 0.0);
  for (int i = 1; i <= n; ++i) low = std::min(low, Evaluate(p, static_cast<double>(i) / n));
  return low;
}

TEST(Polynomial, ProductSumAndDerivativeAgreeWithTheirValues) {
  auto g = Generator(1);
  for (int i = 0; i < 200; ++i) {
    const Polynomial p = Random(g, i % 7), q = Random(g, i % 5);
    const double t = Uniform(g, -1.5, 1.5), h = 1e-6;
    EXPECT_NEAR(Evaluate(Product(p, q), t), Evaluate(p, t) * Evaluate(q, t), 1e-12);
    EXPECT_NEAR(Evaluate(Sum(p, q, -2.0), t), Evaluate(p, t) - 2.0 * Evaluate(q, t), 1e-12);
    EXPECT_NEAR(Evaluate(Derivative(p), t), (Evaluate(p, t + h) - Evaluate(p, t - h)) / (2 * h),
                1e-6);
  }
}

TEST(Bernstein, ConversionsAgreeWithEvaluation) {
  auto g = Generator(2);
  for (int i = 0; i < 300; ++i) {
    const Polynomial p = Random(g, i % 13);
    const Polynomial b = PowerToBernstein(p);
    const double t = Uniform(g, 0.0, 1.0);
    EXPECT_NEAR(EvaluateBernstein(b, t), Evaluate(p, t), 1e-13 * (1.0 + p.cwiseAbs().sum()));
    EXPECT_LT((BernsteinToPower(b) - p).cwiseAbs().maxCoeff(), 1e-9);
    const Polynomial q = Random(g, 3);
    EXPECT_NEAR(EvaluateBernstein(BernsteinProduct(b, PowerToBernstein(q)), t),
                Evaluate(p, t) * Evaluate(q, t), 1e-12);
    EXPECT_NEAR(EvaluateBernstein(ElevateBernstein(b, i % 13 + 3), t), Evaluate(p, t), 1e-12);
  }
}

TEST(Bernstein, SplitPartsAreTheSamePolynomial) {
  auto g = Generator(3);
  for (int i = 0; i < 100; ++i) {
    const Polynomial b = Random(g, 1 + i % 12);
    const double cut = i % 2 ? 0.5 : Uniform(g, 0.1, 0.9), t = Uniform(g, 0.0, 1.0);
    Polynomial left, right;
    SplitBernstein(b, cut, &left, &right);
    EXPECT_NEAR(EvaluateBernstein(left, t), EvaluateBernstein(b, cut * t), 1e-13);
    EXPECT_NEAR(EvaluateBernstein(right, t), EvaluateBernstein(b, cut + (1 - cut) * t), 1e-13);
  }
}

TEST(Sturm, CountsKnownRoots) {
  EXPECT_EQ(CountRootsSturm(FromRoots({0.2, 0.5, 0.9, 1.5, -0.3})), 3);
  EXPECT_EQ(CountRootsSturm(FromRoots({1.2, -0.5})), 0);
  EXPECT_EQ(CountRootsSturm(Poly({1.0, 0.0, 1.0})), 0);
  EXPECT_EQ(CountRootsSturm(Poly({3.0})), 0);
}

TEST(Exact, CountsKnownRootsInHalfOpenInterval) {
  EXPECT_EQ(CountRootsExact(FromRoots({0.25, 0.5, 0.875, 1.5, -0.25})), 3);
  EXPECT_EQ(CountRootsExact(FromRoots({0.0, 0.5})), 1) << "0 is outside";
  EXPECT_EQ(CountRootsExact(FromRoots({1.0, 0.5})), 2) << "1 is inside";
  EXPECT_EQ(CountRootsExact(FromRoots({0.5, 0.5, 0.5})), 1) << "distinct roots count once";
  EXPECT_EQ(CountRootsExact(FromRoots({1.0, 1.0, 0.0, 0.0})), 1);
  EXPECT_EQ(CountRootsExact(Poly({1.0, 0.0, 1.0})), 0);
  EXPECT_EQ(CountRootsExact(Poly({2.0, 0.0, 0.0})), 0) << "zero leading coefficients";
  EXPECT_EQ(CountRootsExact(Poly({0.0, 0.0})), -1);
}

TEST(Exact, ArithmeticOnDoublesHasNoRounding) {
  const ExactPolynomial tiny = MakeExact(Poly({1.0, 0x1p-200}));
  const ExactPolynomial square = tiny * tiny;
  const ExactPolynomial rest = square - MakeExact(Poly({1.0, 0x1p-199})) -
                               MakeExact(Poly({0.0, 0.0, 1.0})) * MakeExact(0x1p-400);
  for (const auto& c : rest.c) EXPECT_EQ(c, 0);
}

TEST(Exact, AgreesWithSturmOnWellSeparatedPolynomials) {
  auto g = Generator(4);
  for (int i = 0; i < 500; ++i) {
    std::vector<double> roots(1 + static_cast<size_t>(i % 6));
    for (size_t k = 0; k < roots.size(); ++k)
      roots[k] = -0.45 + 0.3 * static_cast<double>(k) + Uniform(g, 0.0, 0.2);
    const Polynomial p = Product(FromRoots(roots), Poly({2.0, -1.0, 1.0}));
    EXPECT_EQ(CountRootsExact(p), CountRootsSturm(p)) << "instance " << i;
  }
}

TEST(Positivity, DecisionsOnRandomPolynomialsAreExact) {
  auto g = Generator(5);
  int positive = 0;
  for (int i = 0; i < 100000; ++i) {
    Polynomial p = Product(Random(g, 5), Random(g, 5));
    p[0] += Uniform(g, -0.1, 0.6);
    const Positivity decided = DecidePositive(PowerToBernstein(p), PowerToBernsteinError(p));
    const bool exact = IsPositiveExact(MakeExact(p));
    positive += exact;
    ASSERT_NE(decided, exact ? Positivity::kNotPositive : Positivity::kPositive) << i;
    ASSERT_EQ(IsPositive(p), exact) << i;
    ASSERT_TRUE(!exact || MinimumBySampling(p, 50) > 0.0) << i;
  }
  EXPECT_GT(positive, 10000);
  EXPECT_LT(positive, 90000);
}

// A double root inside: touching zero is not positive, and no rounding may hide it.
TEST(Positivity, DoubleRootsAreNeverAccepted) {
  auto g = Generator(6);
  for (int i = 0; i < 2700; ++i) {
    const double r = std::floor(Uniform(g, 1.0, 63.0)) / 64.0;
    Polynomial u(5);
    for (auto& c : u) c = std::floor(Uniform(g, -8.0, 8.0));
    Polynomial factor = Product(u, u);
    factor[0] += 1.0;
    const Polynomial p = Product(factor, FromRoots({r, r}));
    EXPECT_NE(DecidePositive(PowerToBernstein(p), PowerToBernsteinError(p)), Positivity::kPositive);
    EXPECT_FALSE(IsPositive(p));
    EXPECT_TRUE(IsPositive(Sum(p, Poly({1e-9}))));
    EXPECT_FALSE(IsPositive(Sum(p, Poly({-1e-9}))));
  }
}

TEST(Positivity, EndPointsCount) {
  EXPECT_FALSE(IsPositive(Poly({0.0, 1.0})));
  EXPECT_FALSE(IsPositive(Poly({1.0, -1.0})));
  EXPECT_TRUE(IsPositive(Poly({1e-300})));
  EXPECT_FALSE(IsPositive(Poly({0.0})));
  EXPECT_FALSE(IsPositive(Poly({-1.0})));
}

TEST(Positivity, TinyLeadingCoefficientsAreHarmless) {
  for (double lead : {1e-8, 1e-12, 1e-16, 1e-20, 1e-300, 0.0}) {
    EXPECT_TRUE(IsPositive(Poly({0.5, -1.0, 1.0, lead, -lead})));
    EXPECT_FALSE(IsPositive(Poly({0.25, -1.0, 1.0, 0.0, -lead})) && lead > 0.0);
  }
}

TEST(Positivity, NotFiniteIsNotPositive) {
  EXPECT_FALSE(IsPositive(Poly({1.0, std::nan("")})));
  EXPECT_FALSE(IsPositive(Poly({INFINITY})));
  EXPECT_FALSE(IsPositive(Polynomial()));
}

// (1-s)^2 P + 2 s (1-s) S + s^2 Q > 0 on the unit square, by a dense grid.
bool SightClearOnGrid(const Polynomial& P, const Polynomial& Q, const Polynomial& S, double* low) {
  *low = 1e9;
  for (int i = 0; i <= 100; ++i)
    for (int j = 0; j <= 40; ++j) {
      const double t = i / 100.0, s = j / 40.0;
      *low = std::min(*low, (1 - s) * (1 - s) * Evaluate(P, t) + 2 * s * (1 - s) * Evaluate(S, t) +
                                s * s * Evaluate(Q, t));
    }
  return *low > 0.0;
}

TEST(SightClearExact, AgreesWithADenseGrid) {
  auto g = Generator(7);
  int clear = 0, undecidable = 0;
  for (int i = 0; i < 400; ++i) {
    Polynomial P = Product(Random(g, 3), Random(g, 3)), Q = Random(g, 6), S = Random(g, 6);
    P[0] += 1.5, Q[0] += 1.5, S[0] += Uniform(g, -0.7, 0.6);
    double low = 0.0;
    const bool grid = SightClearOnGrid(P, Q, S, &low);
    if (std::abs(low) < 0.02) {
      ++undecidable;
      continue;
    }
    clear += grid;
    EXPECT_EQ(IsSightClearExact(MakeExact(P), MakeExact(Q), MakeExact(S)), grid) << i << " " << low;
  }
  EXPECT_GT(clear, 40);
  EXPECT_LT(clear + undecidable, 360);
}

TEST(SightClearExact, TouchingIsNotClear) {
  const auto one = MakeExact(1.0);
  EXPECT_TRUE(IsSightClearExact(one, one, one)) << "P Q = S^2 with S > 0";
  EXPECT_FALSE(IsSightClearExact(one, one, MakeExact(-1.0))) << "S = -1: touches at s = 1/2";
  EXPECT_TRUE(IsSightClearExact(one, one, MakeExact(-0.5)));
  // S = -(4t(1-t)): reaches -1 at t = 1/2 only.
  EXPECT_FALSE(IsSightClearExact(one, one, MakeExact(Poly({0.0, -4.0, 4.0}))));
}

}  // namespace
}  // namespace chase::math
