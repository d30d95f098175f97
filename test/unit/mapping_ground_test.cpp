#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <set>

#include "services/mapping/ground_slabs.h"

namespace chase::mapping {
namespace {

using Eigen::Vector3d;
using Surface = std::function<double(double, double)>;
constexpr double kHeight = 0.3;  // m

/// A sensor 1.5 m above the ground at (x, y) sees all of it within 15 m.
void See(const Surface& surface, double x, double y, GroundModel* ground) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> within(-15.0, 15.0);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 30000; ++i) {
    const double px = x + within(random), py = y + within(random);
    points.push_back(Vector3d(px, py, surface(px, py)).cast<float>());
  }
  for (int i = 0; i < 20; ++i) ground->Update(points, {x, y, surface(x, y) + 1.5});
}

std::vector<world::Obstacle> SlabsOf(const Surface& surface, double x, double y) {
  GroundModel ground{GroundConfig()};
  See(surface, x, y, &ground);
  return GroundSlabs(ground, {x, y, surface(x, y) + 1.5}, 9.0, kHeight, 1.0, 3.0);
}

/// Height of the slabs' upper sides at (x, y), m.
double Top(const std::vector<world::Obstacle>& slabs, double x, double y) {
  double top = -1e9;
  for (const auto& o : slabs) {
    const Eigen::Matrix3d R = o.axes.toRotationMatrix();
    const Vector3d n = R.col(2), c = o.center.Position(1.0) + o.half.z() * n;
    const Vector3d p(x, y, c.z() - (n.x() * (x - c.x()) + n.y() * (y - c.y())) / n.z());
    const Vector3d local = R.transpose() * (p - c);
    if (std::abs(local.x()) <= o.half.x() && std::abs(local.y()) <= o.half.y())
      top = std::max(top, p.z());
  }
  return top;
}

/// What is too low to be listed as an obstacle lies within the slabs, and they are little higher.
void ExpectCovered(const Surface& surface, const std::vector<world::Obstacle>& slabs, double x,
                   double y, double most) {
  std::set<int> ids;
  for (const auto& o : slabs) {
    EXPECT_TRUE(o.ground);
    EXPECT_TRUE(ids.insert(o.id).second) << o.id;
    EXPECT_EQ(o.solid, world::Obstacle::Solid::kBox);
  }
  for (double dx = -6.0; dx <= 6.0; dx += 0.37)
    for (double dy = -6.0; dy <= 6.0; dy += 0.41) {
      const double z = surface(x + dx, y + dy), top = Top(slabs, x + dx, y + dy);
      EXPECT_GT(top, z + 0.5 * kHeight) << x + dx << " " << y + dy;
      EXPECT_LT(top, z + kHeight + most) << x + dx << " " << y + dy;
    }
}

TEST(GroundSlabs, LevelGroundAndASlopeAreFewSlabs) {
  for (const double slope : {0.0, 0.1, -0.2}) {
    const Surface plane = [&](double x, double y) { return slope * x + 0.05 * y - 0.4; };
    const auto slabs = SlabsOf(plane, 3.0, -5.0);
    EXPECT_LE(slabs.size(), 4u);
    ExpectCovered(plane, slabs, 3.0, -5.0, 0.15);
  }
}

TEST(GroundSlabs, AHillIsCoveredByMoreOfThem) {
  // What is steeper than the tiles follow is listed as an obstacle instead.
  const Surface hill = [](double x, double y) { return 0.8 * std::exp(-(x * x + y * y) / 50.0); };
  const auto slabs = SlabsOf(hill, 2.0, 1.0);
  EXPECT_GT(slabs.size(), 4u);
  EXPECT_LE(slabs.size(), 40u);
  ExpectCovered(hill, slabs, 2.0, 1.0, 0.6);
}

TEST(GroundSlabs, TheirEllipsoidsHoldTheirCorners) {
  for (const auto& o : SlabsOf([](double x, double y) { return 0.1 * x - 0.1 * y; }, 0.0, 0.0))
    for (int i = 0; i < 8; ++i) {
      const Vector3d corner =
          o.half.cwiseProduct(Vector3d(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0));
      EXPECT_LE((o.axes * corner).dot(o.shape * (o.axes * corner)), 1.0 + 1e-9);
    }
}

TEST(GroundSlabs, APlaceKeepsItsIdAsTheDroneMoves) {
  const Surface plane = [](double x, double) { return 0.1 * x; };
  GroundModel ground{GroundConfig()};
  See(plane, 4.0, 4.0, &ground);
  const auto before = GroundSlabs(ground, {4.0, 4.0, 2.0}, 3.0, kHeight, 0.0, 3.0);
  const auto after = GroundSlabs(ground, {6.0, 5.0, 2.0}, 3.0, kHeight, 1.0, 3.0);
  ASSERT_EQ(before.size(), 1u);
  ASSERT_EQ(after.size(), 1u);
  EXPECT_EQ(before[0].id, after[0].id);
  EXPECT_EQ(before[0].shape, after[0].shape);
}

TEST(GroundSlabs, NothingSeenNothingListed) {
  const GroundModel ground{GroundConfig()};
  EXPECT_TRUE(GroundSlabs(ground, {0.0, 0.0, 1.0}, 9.0, kHeight, 0.0, 3.0).empty());
}

}  // namespace
}  // namespace chase::mapping
