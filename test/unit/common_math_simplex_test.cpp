#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "common/math/simplex.h"

namespace chase::math {
namespace {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

Points RandomPoints(std::mt19937_64& g, size_t n, double flatness) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const Vector3d shift(1.5 * u(g), 1.5 * u(g), 1.5 * u(g));
  Points points;
  for (size_t i = 0; i < n; ++i) points.push_back(shift + Vector3d(u(g), u(g), flatness * u(g)));
  return points;
}

Vector3d Lowest(const Points& points, const Vector3d& n) {
  return *std::min_element(points.begin(), points.end(), [&](const Vector3d& a, const Vector3d& b) {
    return n.dot(a) < n.dot(b);
  });
}

/// The point of the hull nearest to the origin, by support points.
Vector3d Nearest(const Points& points) {
  Simplex simplex;
  simplex.Add(points[0]);
  while (simplex.Add(Lowest(points, simplex.nearest()))) {
  }
  return simplex.nearest();
}

/// x is the nearest point of the hull exactly when x' p >= x' x for all points p, and x is in the
/// hull; of that the second is checked by the simplex being made of the points.
TEST(Simplex, FindsTheNearestPointOfTheHullOfManyPoints) {
  for (unsigned seed = 0; seed < 3000; ++seed) {
    std::mt19937_64 g(seed);
    const Points points = RandomPoints(g, 1 + seed % 20, seed % 3 ? 1.0 : 1e-3);
    const Vector3d x = Nearest(points);
    for (const Vector3d& p : points) ASSERT_GE(x.dot(p), x.squaredNorm() - 1e-9) << "seed " << seed;
    ASSERT_LE(x.norm(), points[0].norm() + 1e-12) << "seed " << seed;
  }
}

TEST(Simplex, RefusesWhatAddsNothing) {
  Simplex simplex;
  EXPECT_TRUE(simplex.Add({1.0, 0.0, 0.0}));
  EXPECT_FALSE(simplex.Add({1.0, 0.0, 0.0}));
  EXPECT_FALSE(simplex.Add({2.0, 0.0, 0.0}));
  EXPECT_TRUE(simplex.Add({0.5, 0.5, 0.0}));
  EXPECT_FALSE(simplex.Add({0.5, 0.5, 0.0}));
  EXPECT_NEAR(simplex.nearest().x(), 0.5, 1e-15);
}

TEST(Simplex, HoldsTheOriginInsideFourPoints) {
  Simplex simplex;
  EXPECT_TRUE(simplex.Add({1.0, 1.0, 1.0}));
  EXPECT_TRUE(simplex.Add({-1.0, -1.0, 1.0}));
  EXPECT_TRUE(simplex.Add({-1.0, 1.0, -1.0}));
  EXPECT_TRUE(simplex.Add({1.0, -1.0, -1.0}));
  EXPECT_EQ(simplex.size(), 4);
  EXPECT_LT(simplex.nearest().norm(), 1e-15);
}

}  // namespace
}  // namespace chase::math
