#include <gtest/gtest.h>

#include <cmath>

#include "common/world/manoeuvre.h"

namespace chase::world {
namespace {

/// The double integral as a sum: the place is where the accelerations of n steps lead.
double SummedVariance(const Manoeuvre& m, double t) {
  constexpr int kSteps = 400;
  const double dt = t / kSteps;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i)
    for (int k = 0; k < kSteps; ++k) {
      const double s = (i + 0.5) * dt, u = (k + 0.5) * dt;
      sum += (t - s) * (t - u) * std::exp(-std::abs(s - u) / m.memory);
    }
  return m.acceleration * m.acceleration * sum * dt * dt;
}

TEST(Manoeuvre, VarianceIsTheDoubleIntegralOfTheCorrelation) {
  for (const double memory : {0.2, 0.5, 3.0, 100.0})
    for (const double t : {0.01, 0.1, 0.499, 0.501, 1.0, 2.5, 6.0}) {
      const Manoeuvre m{0.7, memory};
      const double summed = SummedVariance(m, t);
      EXPECT_NEAR(m.Variance(t), summed, 2e-3 * summed) << memory << " " << t;
    }
  EXPECT_EQ(Manoeuvre{}.Variance(2.0), 0.0);
  EXPECT_EQ((Manoeuvre{1.0, 0.5}.Variance(0.0)), 0.0);
}

/// A chord over the deviation is above it, and so is the end's share of t^2 over the variance.
TEST(Manoeuvre, DeviationIsConvexAndVarianceOverSquaredTimeGrows) {
  for (const double memory : {0.2, 0.5, 3.0}) {
    const Manoeuvre m{0.5, memory};
    const auto deviation = [&](double t) { return std::sqrt(4e-4 + 0.01 * t * t + m.Variance(t)); };
    double before = 0.0;
    for (double t = 0.02; t < 5.0; t += 0.02) {
      EXPECT_LE(deviation(t), 0.5 * (deviation(t - 0.02) + deviation(t + 0.02)) + 1e-12) << t;
      EXPECT_GE(m.Variance(t) / (t * t), before) << t;
      before = m.Variance(t) / (t * t);
    }
  }
}

}  // namespace
}  // namespace chase::world
