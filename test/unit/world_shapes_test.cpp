#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "common/world/random.h"
#include "common/world/shapes.h"

namespace chase::world {
namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
constexpr Solid::Kind kKinds[] = {Solid::Kind::kBox, Solid::Kind::kCylinder,
                                  Solid::Kind::kEllipsoid};

Vector3d RandomVector(Random* random, double reach) {
  const double x = random->Uniform(-reach, reach), y = random->Uniform(-reach, reach);
  return {x, y, random->Uniform(-reach, reach)};
}

Solid RandomSolid(Solid::Kind kind, Random* random) {
  Solid solid;
  solid.kind = kind;
  solid.center = RandomVector(random, 2.0);
  solid.half_size = {random->Uniform(0.2, 1.5), random->Uniform(0.2, 1.5),
                     random->Uniform(0.2, 1.5)};
  if (kind == Solid::Kind::kCylinder) solid.half_size.y() = solid.half_size.x();
  solid.yaw = random->Uniform(-kPi, kPi);
  return solid;
}

Vector3d ToLocal(const Solid& solid, const Vector3d& x) {
  return Eigen::AngleAxisd(-solid.yaw, Vector3d::UnitZ()) * (x - solid.center);
}

/// Membership straight from the definitions.
bool Inside(const Solid& solid, const Vector3d& x) {
  const Vector3d u = ToLocal(solid, x).cwiseQuotient(solid.half_size);
  if (solid.kind == Solid::Kind::kBox) return u.cwiseAbs().maxCoeff() <= 1.0;
  if (solid.kind == Solid::Kind::kCylinder)
    return u.head<2>().norm() <= 1.0 && std::abs(u.z()) <= 1.0;
  return u.norm() <= 1.0;
}

/// Points on the surface, from parameters in [0, 1): a point of the unit cube's, cylinder's or
/// ball's surface stretched by the half sizes.
Vector3d SurfacePoint(const Solid& solid, int face, double a, double b) {
  const double angle = 2.0 * kPi * a;
  Vector3d u;
  if (solid.kind == Solid::Kind::kBox) {
    u[face % 3] = face < 3 ? -1.0 : 1.0;
    u[(face + 1) % 3] = 2.0 * a - 1.0;
    u[(face + 2) % 3] = 2.0 * b - 1.0;
  } else if (solid.kind == Solid::Kind::kCylinder) {
    const double r = face < 2 ? 1.0 : b;
    u = {r * std::cos(angle), r * std::sin(angle),
         face < 2 ? 2.0 * b - 1.0 : (face % 2 ? 1.0 : -1.0)};
  } else {
    const double latitude = kPi * (b - 0.5);
    u = {std::cos(latitude) * std::cos(angle), std::cos(latitude) * std::sin(angle),
         std::sin(latitude)};
  }
  return solid.center +
         Eigen::AngleAxisd(solid.yaw, Vector3d::UnitZ()) * solid.half_size.cwiseProduct(u);
}

double SampledDistance(const Solid& solid, const Vector3d& x) {
  double least = 1e9;
  constexpr int n = 120;
  for (int face = 0; face < 6; ++face)
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j) {
        const Vector3d p =
            SurfacePoint(solid, face, static_cast<double>(i) / n, static_cast<double>(j) / n);
        least = std::min(least, (p - x).norm());
      }
  return least;
}

class Shapes : public ::testing::TestWithParam<Solid::Kind> {};

TEST_P(Shapes, DistanceAgreesWithSampledSurface) {
  Random random(11);
  for (int i = 0; i < 25; ++i) {
    const Solid solid = RandomSolid(GetParam(), &random);
    const Vector3d x = solid.center + RandomVector(&random, 2.0);
    const double distance = SignedDistance(solid, x), sampled = SampledDistance(solid, x);
    EXPECT_EQ(distance <= 0.0, Inside(solid, x)) << "sample " << i;
    EXPECT_LE(std::abs(distance), sampled + 1e-9) << "sample " << i;
    const double spacing = 0.05 * solid.half_size.maxCoeff();
    EXPECT_GE(std::abs(distance), sampled - spacing) << "sample " << i;
  }
}

TEST_P(Shapes, DistanceIsZeroOnTheSurface) {
  Random random(12);
  for (int i = 0; i < 500; ++i) {
    const Solid solid = RandomSolid(GetParam(), &random);
    const int face = static_cast<int>(random.Uniform(0.0, 6.0));
    const double a = random.Uniform(), b = random.Uniform();
    EXPECT_NEAR(SignedDistance(solid, SurfacePoint(solid, face, a, b)), 0.0, 1e-9);
  }
}

/// |grad d| = 1 and a step along it changes d by the step: d is a distance, not only a level.
TEST_P(Shapes, DistanceGrowsOneForOneOutside) {
  Random random(13);
  for (int i = 0; i < 300; ++i) {
    const Solid solid = RandomSolid(GetParam(), &random);
    const Vector3d x = solid.center + RandomVector(&random, 3.0);
    const double d = SignedDistance(solid, x), h = 1e-5;
    if (d < 0.05) continue;
    Vector3d gradient;
    for (int k = 0; k < 3; ++k) {
      const Vector3d step = h * Vector3d::Unit(k);
      gradient[k] = (SignedDistance(solid, x + step) - SignedDistance(solid, x - step)) / (2 * h);
    }
    EXPECT_NEAR(gradient.norm(), 1.0, 1e-4);
    EXPECT_NEAR(SignedDistance(solid, x - d * gradient), 0.0, 1e-4);
  }
}

TEST_P(Shapes, SegmentTestAgreesWithSampledSegment) {
  Random random(14);
  int hits = 0;
  for (int i = 0; i < 400; ++i) {
    const Solid solid = RandomSolid(GetParam(), &random);
    const Vector3d p = solid.center + RandomVector(&random, 3.0);
    const Vector3d q = solid.center + RandomVector(&random, 3.0);
    double least = 1e9;
    for (int k = 0; k <= 2000; ++k)
      least = std::min(least, SignedDistance(solid, p + k / 2000.0 * (q - p)));
    hits += least <= 0.0;
    if (std::abs(least) < 0.01) continue;  // sampling cannot tell
    EXPECT_EQ(SegmentHits(solid, p, q), least <= 0.0) << "segment " << i;
  }
  EXPECT_GT(hits, 40);
}

INSTANTIATE_TEST_SUITE_P(Kinds, Shapes, ::testing::ValuesIn(kKinds));

TEST(Ellipsoid, DegeneratePointsHaveTheirClosedForms) {
  Solid solid;
  solid.kind = Solid::Kind::kEllipsoid;
  solid.half_size = {3.0, 2.0, 1.0};
  EXPECT_NEAR(SignedDistance(solid, {0.0, 0.0, 0.0}), -1.0, 1e-12);
  EXPECT_NEAR(SignedDistance(solid, {5.0, 0.0, 0.0}), 2.0, 1e-9);
  EXPECT_NEAR(SignedDistance(solid, {0.0, 0.0, -4.0}), 3.0, 1e-9);
  EXPECT_NEAR(SignedDistance(solid, {0.0, 1e-200, 0.0}), -1.0, 1e-9);
  solid.half_size = {1.0, 1.0, 1.0};
  EXPECT_NEAR(SignedDistance(solid, {0.0, 0.0, 0.0}), -1.0, 1e-12);
  EXPECT_NEAR(SignedDistance(solid, {0.3, 0.4, 0.0}), -0.5, 1e-9);
  EXPECT_NEAR(SignedDistance(solid, {0.0, 0.25, 0.0}), -0.75, 1e-9);
}

TEST(Segment, APointIsASegmentToo) {
  Solid solid;
  EXPECT_TRUE(SegmentHits(solid, {0.2, 0.2, 0.2}, {0.2, 0.2, 0.2}));
  EXPECT_FALSE(SegmentHits(solid, {1.2, 0.2, 0.2}, {1.2, 0.2, 0.2}));
}

}  // namespace
}  // namespace chase::world
