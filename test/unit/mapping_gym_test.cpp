#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "mapping_metrics.h"
#include "mapping_world.h"
#include "services/mapping/mapper.h"

namespace chase::mapping {
namespace {

using testing::GymFlight;
using testing::SensorNoise;

/// A flight through the gym, 0.2 s between sweeps; calls `look` after each one.
template <class Look>
void Fly(int sweeps, const SensorNoise& noise, unsigned seed, Look&& look) {
  const testing::World world = testing::Gym();
  std::mt19937 random(seed);
  Mapper mapper(MappingConfig{});
  for (int i = 0; i < sweeps; ++i) {
    const double t = 0.2 * i;
    testing::Truth truth;
    const Sweep sweep = testing::Scan(world, GymFlight(t), t, noise, &random, &truth);
    const ObstacleList list = mapper.Insert(sweep);
    mapper.UpdateTree();
    look(i, t, list, truth, &mapper);
  }
}

TEST(MappingGym, SurfacesAreCoveredAndFreeSpaceStaysFree) {
  const testing::World world = testing::Gym();
  for (const SensorNoise& noise : {SensorNoise{0.02, 0.01}, SensorNoise{0.03, 0.02, 0.003}}) {
    testing::HitCounter hits;
    double covered = 0.0;
    int checks = 0;
    Fly(125, noise, 17,
        [&](int i, double t, const ObstacleList& list, const testing::Truth& truth, Mapper*) {
          hits.Add(truth);
          EXPECT_EQ(list.n_moving, 0) << "false mover at " << t;
          EXPECT_LE(list.n_static, 60);
          if (i % 25 != 24) return;
          int points = 0;
          covered += hits.Coverage(list.obstacles, GymFlight(t), 8.0, t, &points);
          ++checks;
          EXPECT_GT(points, 3000);
          EXPECT_LT(testing::Blocked(world, list.obstacles, {0.5, 0.5}, {14.5, 7.5}, t), 0.08);
        });
    EXPECT_GT(covered / checks, 0.999) << "range noise " << noise.range;
  }
}

TEST(MappingGym, PillarsAreSlenderOverTheWholeFlightVolume) {
  Fly(100, {0.02, 0.015}, 5,
      [&](int i, double t, const ObstacleList& list, const testing::Truth&, Mapper*) {
        if (i < 99) return;
        for (const auto& center : testing::GymPillars()) {
          if ((center - GymFlight(t).head<2>()).norm() > 8.0) continue;
          const auto* o = testing::Holding(list.obstacles, {center.x(), center.y(), 1.2}, t);
          ASSERT_NE(o, nullptr) << center.transpose();
          EXPECT_LE(testing::SectionRadius(*o, 1.6), 0.40) << center.transpose();
          EXPECT_GE(testing::SectionRadius(*o, 0.3), 0.27) << center.transpose();
          EXPECT_GE(testing::SectionRadius(*o, 2.5), 0.27) << center.transpose();
        }
      });
}

TEST(MappingGym, IdsOfPillarsStay) {
  std::map<size_t, std::set<int>> ids;
  Fly(150, {0.02, 0.01}, 3,
      [&](int i, double t, const ObstacleList& list, const testing::Truth&, Mapper*) {
        if (i < 10) return;
        const auto pillars = testing::GymPillars();
        for (size_t k = 0; k < pillars.size(); ++k) {
          const auto* o =
              testing::Holding(list.obstacles, {pillars[k].x(), pillars[k].y(), 1.2}, t);
          if (o) ids[k].insert(o->id);
        }
      });
  EXPECT_EQ(ids.size(), 7u);
  for (const auto& [pillar, seen] : ids) EXPECT_LE(seen.size(), 2u) << "pillar " << pillar;
}

/// The promise itself: every return in every occupied cell of the flight volume is enclosed.
TEST(MappingGym, EveryOccupiedCellIsEnclosed) {
  const double radius = MappingConfig().statics.radius;
  Fly(40, {0.02, 0.01}, 8,
      [&](int i, double t, const ObstacleList& list, const testing::Truth&, Mapper* mapper) {
        if (i % 13 != 12) return;
        VoxelGrid& grid = mapper->grid();
        int checked = 0;
        for (int x = 0; x < 75; ++x)
          for (int y = 0; y < 40; ++y) {
            const auto* column = grid.Find(x, y);
            if (!column) continue;
            for (int z = grid.z0(); z < grid.z0() + VoxelGrid::kLevels; ++z) {
              const Voxel& voxel = column->voxels[VoxelGrid::Level(z)];
              const Eigen::Vector3d center = grid.Center({x, y, z});
              // The band's lower end follows the ground's estimate: 0.3 m above it, at most 0.25 m
              // high.
              if (!voxel.occupied || voxel.extent.empty() || center.z() < 0.7 || center.z() > 2.7)
                continue;
              if ((center - GymFlight(t)).head<2>().norm() > radius - 0.2) continue;
              std::array<Eigen::Vector2d, 8> corners;
              const int n = PlanCorners(voxel.extent, center.head<2>(), grid.step(), &corners);
              for (int k = 0; k < n; ++k) {
                const Eigen::Vector2d c = corners[static_cast<size_t>(k)], d = c - center.head<2>();
                // Corners of slabs that hardly meet lie outside one of them: no return was there.
                const double sum = d.sum() / std::sqrt(2.0),
                             difference = (d.x() - d.y()) / std::sqrt(2.0);
                const double step = grid.step();
                if (sum > step * voxel.extent.high[2] + 1e-3 ||
                    sum < step * voxel.extent.low[2] - 1e-3 ||
                    difference > step * voxel.extent.high[3] + 1e-3 ||
                    difference < step * voxel.extent.low[3] - 1e-3)
                  continue;
                EXPECT_NE(testing::Holding(list.obstacles, {c.x(), c.y(), center.z()}, t), nullptr)
                    << c.transpose() << " " << center.z();
              }
              ++checked;
            }
          }
        EXPECT_GT(checked, 300);
      });
}

TEST(MappingGym, ListIsNearestFirstAndSaysWhatItCut) {
  MappingConfig config;
  config.max_obstacles = 5;
  Mapper bounded(config);
  const testing::World world = testing::Gym();
  std::mt19937 random(1);
  ObstacleList list;
  for (int i = 0; i < 5; ++i)
    list = bounded.Insert(testing::Scan(world, {4.0, 4.0, 1.3}, 0.1 * i, {}, &random));
  const auto is_ground = [](const world::Obstacle& o) { return o.ground; };
  ASSERT_GE(list.obstacles.size(), 5u);
  EXPECT_TRUE(std::none_of(list.obstacles.begin(), list.obstacles.begin() + 5, is_ground));
  EXPECT_TRUE(std::all_of(list.obstacles.begin() + 5, list.obstacles.end(), is_ground));
  EXPECT_GT(list.n_cut, 0);
  EXPECT_EQ(list.n_cut + 5, list.n_static);
  // The pillar at (4, 5.8) is 1.5 m away, that at (6, 3.4) 1.8 m, that at (2.5, 2) 2.2 m.
  EXPECT_NEAR(list.obstacles[0].center.Position(0.0).y(), 5.8, 0.2);
  EXPECT_NEAR(list.obstacles[1].center.Position(0.0).x(), 6.0, 0.2);
}

/// Behind the pillar at (4, 5.8) nothing was seen; from the other side it is.
TEST(MappingGym, ListsWhatIsUnseenUntilItIsSeen) {
  const testing::World world = testing::Gym();
  for (const double reach : {0.0, 5.0}) {
    MappingConfig config;
    config.statics.unseen = reach;
    Mapper mapper(config);
    std::mt19937 random(1);
    double t = 0.0;
    const auto look = [&](const Eigen::Vector3d& from) {
      ObstacleList list;
      for (int i = 0; i < 10; ++i, t += 0.1)
        list = mapper.Insert(testing::Scan(world, from, t, {}, &random));
      return list;
    };
    const ObstacleList first = look({4.0, 4.0, 1.3});
    for (const double y : {6.5, 7.0, 7.5}) {
      EXPECT_EQ(testing::Holding(first.unseen, {4.0, y, 1.3}, t) != nullptr, reach > 0.0) << y;
      EXPECT_EQ(testing::Holding(first.obstacles, {4.0, y, 1.3}, t), nullptr) << y;
    }
    for (const double y : {3.0, 4.0, 5.0})  // in full sight
      EXPECT_EQ(testing::Holding(first.unseen, {4.0, y, 1.3}, t), nullptr) << y;
    const ObstacleList second = look({6.0, 7.2, 1.3});
    for (const double y : {6.5, 7.0, 7.5})
      EXPECT_EQ(testing::Holding(second.unseen, {4.0, y, 1.3}, t), nullptr) << y;
    EXPECT_NE(testing::Holding(second.obstacles, {4.0, 5.8, 1.3}, t), nullptr);
  }
}

/// A ceiling above the flight volume does not tell what is behind a shelf at the drone's height.
TEST(MappingGym, WhatHangsAboveTheFlightVolumeLeavesAColumnUnseen) {
  testing::World world;
  world.boxes = {{{2.0, 0.0, 0.8}, {0.2, 1.5, 0.8}}, {{0.0, 0.0, 4.4}, {30.0, 30.0, 0.1}}};
  Mapper mapper(MappingConfig{});
  std::mt19937 random(1);
  ObstacleList list;
  // Looks up as well, as it does while it brakes or accelerates.
  for (int i = 0; i < 40; ++i) {
    const Eigen::Quaterniond R_WL(
        Eigen::AngleAxisd(i % 2 == 0 ? 0.0 : -1.0, Eigen::Vector3d::UnitY()));
    list =
        mapper.Insert(testing::Scan(world, {0.0, 0.0, 1.3}, 0.1 * i, {}, &random, nullptr, R_WL));
  }
  const VoxelGrid::Column* column = mapper.grid().Find(13, 0);
  ASSERT_TRUE(column && column->occupied > 0);  // the ceiling
  EXPECT_NE(testing::Holding(list.unseen, {2.7, 0.1, 1.3}, 4.0), nullptr);
  EXPECT_EQ(testing::Holding(list.unseen, {1.4, 0.1, 1.3}, 4.0), nullptr);
}

TEST(MappingGym, SameInputGivesSameBytes) {
  std::vector<double> first, second;
  for (auto* sink : {&first, &second})
    Fly(20, {0.02, 0.01}, 2,
        [&](int, double, const ObstacleList& list, const testing::Truth&, Mapper*) {
          for (const auto& o : list.obstacles) {
            sink->push_back(o.id);
            sink->insert(sink->end(), o.shape.data(), o.shape.data() + 9);
            sink->insert(sink->end(), o.center.coefficients.data(),
                         o.center.coefficients.data() + o.center.coefficients.size());
          }
        });
  EXPECT_FALSE(first.empty());
  EXPECT_TRUE(first == second);
}

TEST(MappingFaults, HostileSweepsNeverBreakTheMap) {
  const testing::World world = testing::Gym();
  std::mt19937 random(1);
  Mapper mapper(MappingConfig{});
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  ObstacleList before, after;
  for (int i = 0; i < 10; ++i)
    before = mapper.Insert(testing::Scan(world, {4.0, 4.0, 1.3}, 0.1 * i, {}, &random));
  Sweep hostile{1.0, {4.0, 4.0, 1.3}, {}, {}};
  EXPECT_GT(mapper.Insert(hostile).n_static, 0);  // an empty sweep changes nothing
  hostile.points = {{nan, 0, 0},  {0, inf, 0},  {1e30f, 1e30f, 1e30f}, {-3e8f, 0, 0},
                    {4, 4, 1.3f}, {4, 4, 1e9f}, {4, 4, -1e9f}};
  mapper.Insert(hostile);
  hostile.origin = {1e300, 0, 0};
  EXPECT_TRUE(mapper.Insert(hostile).obstacles.empty());
  hostile.origin.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(mapper.Insert(hostile).obstacles.empty());
  after = mapper.Insert(testing::Scan(world, {4.0, 4.0, 1.3}, 1.1, {}, &random));
  EXPECT_NEAR(after.n_static, before.n_static, 2);
  for (const auto& o : after.obstacles) {
    EXPECT_TRUE(o.shape.allFinite() && o.center.coefficients.allFinite());
    EXPECT_GT(o.shape.determinant(), 0.0);
  }
}

TEST(MappingFaults, TimeThatStandsOrJumpsIsSurvived) {
  const testing::World world = testing::Gym();
  std::mt19937 random(1);
  Mapper mapper(MappingConfig{});
  for (const double t : {0.0, 0.0, 100.0, -50.0, 1e6})
    EXPECT_GT(mapper.Insert(testing::Scan(world, {4, 4, 1.3}, t, {}, &random)).obstacles.size(),
              0u);
}

}  // namespace
}  // namespace chase::mapping
