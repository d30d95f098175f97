#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "mapping_world.h"
#include "services/mapping/ground.h"
#include "services/mapping/integration.h"
#include "services/mapping/voxel_grid.h"

namespace chase::mapping {
namespace {

Return At(const VoxelGrid& grid, const Eigen::Vector3d& p, Label label = Label::kStatic) {
  return {p.cast<float>(), grid.ToKey(p), label};
}

struct Fixture {
  GridConfig config;
  VoxelGrid grid{config.resolution};
  Integrator integrator{config, &grid};
  Fixture() { grid.MoveTo(Eigen::Vector3d::Zero()); }
  void Insert(const std::vector<Eigen::Vector3d>& points) {
    std::vector<Return> returns;
    for (const auto& p : points) returns.push_back(At(grid, p));
    integrator.Insert({0.05, 0.05, 0.05}, returns);
  }
  bool Occupied(const Eigen::Vector3d& p) {
    const Voxel* voxel = grid.At(grid.ToKey(p));
    return voxel && voxel->occupied;
  }
};

TEST(MappingGrid, FloorIsThatOfTheLibrary) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> value(-1e9, 1e9), small(-3.0, 3.0);
  for (int i = 0; i < 10000; ++i)
    for (const double x : {value(random), small(random), std::round(small(random))})
      for (const double y : {x, std::nextafter(x, -1e10), std::nextafter(x, 1e10)})
        ASSERT_EQ(Floor(y), static_cast<int>(std::floor(y))) << y;
}

TEST(MappingGrid, HitsOccupyAndRaysFreeEveryCellBetween) {
  Fixture f;
  const Eigen::Vector3d wall(4.1, 1.3, 0.7), origin(0.05, 0.05, 0.05);
  for (int i = 0; i < 3; ++i) f.Insert({wall, wall});
  EXPECT_TRUE(f.Occupied(wall));
  for (double s = 0.0; s < 0.9; s += 0.001) {
    const Voxel* voxel = f.grid.At(f.grid.ToKey(origin + s * (wall - origin)));
    ASSERT_NE(voxel, nullptr);
    EXPECT_EQ(voxel->free_sweeps, 3) << s;
  }
}

TEST(MappingGrid, WhatIsGoneIsClearedByRaysThroughIt) {
  Fixture f;
  const Eigen::Vector3d thing(2.1, 0.1, 0.1), behind(4.1, 0.17, 0.17);
  for (int i = 0; i < 10; ++i) f.Insert({thing, thing});
  EXPECT_TRUE(f.Occupied(thing));
  for (int i = 0; i < 10; ++i) f.Insert({behind});
  EXPECT_FALSE(f.Occupied(thing));
}

TEST(MappingGrid, RayBesideReturnsDoesNotClearThem) {
  Fixture f;
  const Eigen::Vector3d surface(2.1, 0.02, 0.1), beyond(4.1, 0.31, 0.31);
  for (int i = 0; i < 5; ++i) f.Insert({surface, surface});
  for (int i = 0; i < 50; ++i) f.Insert({beyond});
  EXPECT_TRUE(f.Occupied(surface));
}

TEST(MappingGrid, OnlyWhatABodyLeftOnItsWayIsCleared) {
  Fixture f;
  const auto body = [](int i) { return Eigen::Vector3d(1.1 + 0.3 * i, 2.1, 0.1); };
  const Eigen::Vector3d stands(2.3, 1.9, 0.1), beside(2.3, 3.3, 0.1), later(1.5, 1.9, 0.1);
  const int n = 9;
  for (int i = 0; i <= n; ++i) {
    std::vector<Eigen::Vector3d> points = {body(i), body(i), stands, stands};
    if (i == 4) points.insert(points.end(), {beside, beside});  // while the body passes
    if (i == n - 1) points.insert(points.end(), {later, later});
    f.Insert(points);
  }
  for (int i = 0; i <= n; ++i) EXPECT_TRUE(f.Occupied(body(i))) << i;
  Ellipse outline{body(n).head<2>(), Eigen::Vector2d(9.0, 9.0).asDiagonal()};
  f.integrator.ClearPassed(outline, {0.3, 0.0}, 20.0, -1.0, 1.0);
  for (int i = 0; i < n - 1; ++i) EXPECT_FALSE(f.Occupied(body(i))) << i;
  EXPECT_TRUE(f.Occupied(body(n)));
  EXPECT_TRUE(f.Occupied(stands));  // hit for longer than the body can have been there
  EXPECT_TRUE(f.Occupied(beside));
  EXPECT_TRUE(f.Occupied(later));  // the body had long left
}

TEST(MappingGrid, WindowRollsWithoutGhosts) {
  Fixture f;
  const Eigen::Vector3d thing(2.1, 0.1, 0.1);
  for (int i = 0; i < 5; ++i) f.Insert({thing, thing});
  const double side = VoxelGrid::kSide * f.config.resolution;
  f.grid.MoveTo({side, 0.0, 0.0});
  EXPECT_EQ(f.grid.At(f.grid.ToKey(thing)), nullptr);
  EXPECT_EQ(f.grid.At(f.grid.ToKey(thing + Eigen::Vector3d(side, 0, 0))), nullptr);
  f.grid.Touch(f.grid.ToKey(thing + Eigen::Vector3d(side, 0, 0)).x, 0);
  EXPECT_FALSE(f.Occupied(thing + Eigen::Vector3d(side, 0, 0)));
}

TEST(MappingGrid, CornersHoldTheReturnsAndHugSlantedOnes) {
  VoxelGrid grid(0.2);
  ExtentMeter meter;
  std::vector<Eigen::Vector2d> points;
  for (double s = -0.09; s <= 0.09; s += 0.01) {
    points.emplace_back(s, -s);
    meter.Add({static_cast<float>(s), static_cast<float>(-s), 0.0f});
  }
  Extent extent = Extent::Nothing();
  Follow(meter, grid.step(), 0.05, &extent);
  std::array<Eigen::Vector2d, 8> corners;
  const int n = PlanCorners(extent, Eigen::Vector2d::Zero(), grid.step(), &corners);
  for (int i = 0; i < n; ++i)
    EXPECT_LT(std::abs(corners[static_cast<size_t>(i)].sum()), 0.01);  // thin across the surface
}

TEST(MappingGrid, ExtentSettlesWhereNoiseIsNotWhereItPeaked) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal(0.0, 0.02);
  VoxelGrid grid(0.2);
  Extent extent = Extent::Nothing();
  double sum = 0.0;
  for (int i = 0; i < 2000; ++i) {
    ExtentMeter meter;
    for (int k = 0; k < 10; ++k) meter.Add({static_cast<float>(normal(random)), 0.0f, 0.0f});
    Follow(meter, grid.step(), 0.08, &extent);
    if (i >= 1000) sum += grid.step() * extent.high[0];
  }
  EXPECT_GT(sum / 1000, 0.02);
  EXPECT_LT(sum / 1000, 0.06);
}

TEST(MappingGround, FollowsGentlyRoughGround) {
  testing::World world = testing::Forest(60.0, 60, 2);
  std::mt19937 random(1);
  GroundModel ground(GroundConfig{});
  Eigen::Vector3d at;
  for (int i = 0; i < 60; ++i) {
    at = {10.0 + 0.3 * i, 30.0, 1.8};
    ground.Update(testing::Scan(world, at, 0.1 * i, {}, &random).points, at);
  }
  for (double dx = -6.0; dx <= 6.0; dx += 1.0)
    for (double dy = -6.0; dy <= 6.0; dy += 1.0) {
      const double x = at.x() + dx, y = at.y() + dy;
      EXPECT_NEAR(ground.Height(x, y), world.Ground(x, y), 0.2) << x << " " << y;
    }
}

TEST(MappingGround, WallsDoNotLiftIt) {
  const testing::World world = testing::Gym();
  std::mt19937 random(1);
  GroundModel ground(GroundConfig{});
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d at = testing::GymFlight(0.2 * i);
    ground.Update(testing::Scan(world, at, 0.2 * i, {}, &random).points, at);
  }
  for (double x = 0.5; x < 15.0; x += 1.0)
    for (double y = 0.5; y < 8.0; y += 1.0) EXPECT_NEAR(ground.Height(x, y), 0.0, 0.25);
}

TEST(MappingGround, NothingToLearnFromIsFine) {
  GroundModel ground(GroundConfig{});
  ground.Update({}, Eigen::Vector3d::Zero());
  EXPECT_EQ(ground.Height(1e30, -1e30), 0.0);
}

TEST(MappingConfig, ProblemsNameFieldValueAndLimit) {
  MappingConfig config;
  EXPECT_EQ(config.Problem(), "");
  config.grid.range = 500.0;
  EXPECT_NE(config.Problem().find("range is 500"), std::string::npos);
  config = {};
  config.statics.band_high = 0.1;
  EXPECT_NE(config.Problem().find("band_high"), std::string::npos);
}

}  // namespace
}  // namespace chase::mapping
