#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "mapping_metrics.h"
#include "mapping_world.h"
#include "services/mapping/forecast.h"
#include "services/mapping/mapper.h"

namespace chase::mapping {
namespace {

constexpr double kStart = 2.0;  // s, when the mover enters

/// A 2.2 m long box that drives along y through a wood of eight trunks.
struct Scene {
  double speed = 2.0;
  Eigen::Vector2d Place(double t) const { return {8.0, -9.0 + speed * (t - kStart)}; }
  testing::World At(double t) const {
    testing::World world;
    for (const double y : {-5.0, 0.0, 5.0}) {
      world.cylinders.push_back({{12.0, y}, 0.3, 0.0, 8.0});
      world.cylinders.push_back({{-5.0, y}, 0.3, 0.0, 8.0});
    }
    world.cylinders.push_back({{4.0, 0.3}, 0.3, 0.0, 8.0});  // hides the mover for a moment
    for (const double x : {-20.0, 25.0}) world.boxes.push_back({{x, 0, 2}, {0.1, 30, 2}});
    const Eigen::Vector2d p = Place(t);
    if (t >= kStart) world.boxes.push_back({{p.x(), p.y(), 1.0}, {0.5, 1.1, 1.0}});
    return world;
  }
};

TEST(MappingMover, IsFoundTrackedAndForgotten) {
  for (const double speed : {1.0, 2.0, 4.0}) {
    Scene scene{speed};
    std::mt19937 random(3);
    Mapper mapper(MappingConfig{});
    std::set<int> ids;
    double found = -1.0, worst = 0.0, worst_hidden = 0.0;
    const double end = kStart + 18.0 / speed;
    for (double t = 0.0; t < end + 1.5; t += 0.1) {
      const testing::World world = t < end ? scene.At(t) : scene.At(0.0);
      const auto list = mapper.Insert(
          testing::Scan(world, {0.2 * std::sin(t), 0.1 * t, 1.5}, t, {0.02, 0.01}, &random));
      for (const auto& o : list.obstacles) {
        if (!o.moving) continue;
        ids.insert(o.id);
        if (found < 0.0) found = t;
        EXPECT_EQ(o.center.degree(), 1);
        // What white noise of 0.4 m^2/s^3 adds in half a second is in it.
        EXPECT_GT(o.velocity_covariance(0, 0), 0.4 / 3.0 * 0.5);
        if (t < found + 1.0 || t > end) continue;
        const double error = (o.center.Velocity(t).head<2>() - Eigen::Vector2d(0, speed)).norm();
        const bool hidden = std::abs(scene.Place(t).y()) < 4.2;  // by the trunk in front, in part
        (hidden ? worst_hidden : worst) = std::max(hidden ? worst_hidden : worst, error);
        // The middle of the side that can be seen.
        const Eigen::Vector3d seen(scene.Place(t).x() - 0.45, scene.Place(t).y(), 1.0);
        EXPECT_NE(testing::Holding({o}, seen, t), nullptr) << t;
      }
      if (t > end + 1.0) {
        EXPECT_EQ(list.n_moving, 0) << "ghost at " << t - end;
      }
      for (double y = -8.0; y < 8.0 && t > end + 1.0; y += 0.2)
        EXPECT_EQ(testing::Holding(list.obstacles, {8.0, y, 1.0}, t), nullptr) << "trail " << y;
    }
    EXPECT_GE(found, 0.0) << speed;
    EXPECT_LT(found, kStart + 0.55) << speed;
    EXPECT_EQ(ids.size(), 1u) << speed;
    EXPECT_LT(worst, 0.3) << speed;
    EXPECT_LT(worst_hidden, 0.9) << speed;
  }
}

TEST(MappingForecast, StopsWhereItsWayEndsAndKeepsItsVelocityUntilThen) {
  world::Obstacle mover;
  mover.center.start = 5.0;
  mover.center.duration = 3.0;
  mover.center.coefficients.resize(2, 3);
  mover.center.coefficients << 1.0, 2.0, 1.5, 2.4, -1.8, 0.0;  // 1 m/s
  const world::Obstacle free = mover;
  StopAfter(3.0, &mover);
  EXPECT_EQ(mover.center.coefficients, free.center.coefficients);
  for (const double way : {0.0, 0.3, 1.0, 2.5}) {
    mover = free;
    StopAfter(way, &mover);
    double last = 0.0;
    for (double t = 5.0; t < 8.0; t += 0.05) {
      const double gone = (mover.center.Position(t) - free.center.Position(5.0)).norm();
      EXPECT_LE(gone, std::min(way, t - 5.0) + 1e-9) << way;
      EXPECT_GE(gone, last - 1e-9) << way;
      last = gone;
    }
    EXPECT_NEAR((mover.center.Position(8.0) - free.center.Position(5.0)).norm(), way, 1e-9);
    if (way >= 0.75) {
      EXPECT_NEAR((mover.center.Velocity(5.0) - free.center.Velocity(5.0)).norm(), 0.0, 1e-9);
    }
  }
}

/// On the side that a drone's tilt raises all rays rise into the sky, and return where a walker is
/// only: that he ends there is seen, and that he turns back.
TEST(MappingMover, WalkersAreSeenBeforeTheSky) {
  for (const double range : {2.0, 3.0, 4.0}) {
    std::mt19937 random(3);
    Mapper mapper(MappingConfig{});
    const auto walked = [](double t) { return t < 3.5 ? t - 2.5 : 4.5 - t; };
    int judged = 0;
    for (double t = 0.0; t < 5.5; t += 0.1) {
      testing::World world;
      world.boxes = {{{-range, walked(t), 0.9}, {0.25, 0.25, 0.9}}};
      const Eigen::Quaterniond R_WL(
          Eigen::AngleAxisd(t < 2.0 ? 0.0 : 0.32, Eigen::Vector3d::UnitY()));
      const auto list =
          mapper.Insert(testing::Scan(world, {0, 0, 1.2}, t, {0.02, 0.01}, &random, nullptr, R_WL));
      if (t < 2.5) continue;
      ASSERT_EQ(list.n_moving, 1) << range << " m, " << t;
      const world::Obstacle& o = list.obstacles.front();
      EXPECT_NEAR(o.center.Position(t).y(), walked(t), 0.2) << range << " m, " << t;
      if (std::abs(t - 3.5) < 0.1 || (t > 3.5 && t < 3.85)) continue;
      ++judged;
      EXPECT_NEAR(o.center.Velocity(t).y(), t < 3.5 ? 1.0 : -1.0, 0.35) << range << " m, " << t;
    }
    EXPECT_GE(judged, 20);
  }
}

/// Rings that move over a table's top as the drone sinks or comes nearer are no movers.
TEST(MappingMover, NothingMovesOverATable) {
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    testing::World world;
    world.boxes = {{{7.0, 0.0, 1.5}, {0.1, 6.0, 1.5}}, {{-7.0, 0.0, 1.5}, {0.1, 6.0, 1.5}}};
    for (int i = 0; i < 8; ++i) {
      const double top = 0.5 + 0.4 * uniform(random), across = i < 4 ? -2.5 : 2.5;
      world.boxes.push_back({{3.0 * (i % 4) - 4.5, across, 0.5 * top},
                             {0.7, 0.4, 0.5 * top},
                             M_PI * uniform(random)});
    }
    Mapper mapper(MappingConfig{});
    for (double t = 0.0; t < 16.0; t += 0.1) {
      const Eigen::Vector3d at(-4.0 + 0.5 * t, 0.5 * std::sin(t), 1.15 + 0.15 * std::sin(0.8 * t));
      const Eigen::Quaterniond R_WL(
          Eigen::AngleAxisd(0.06 * std::sin(1.3 * t), Eigen::Vector3d::UnitY()));
      const auto list =
          mapper.Insert(testing::Scan(world, at, t, {0.02, 0.01}, &random, nullptr, R_WL));
      EXPECT_EQ(list.n_moving, 0) << "seed " << seed << ", " << t;
    }
  }
}

/// A low robot of which one ring sees all that is to be seen, from where rays passed below.
TEST(MappingMover, ALowRobotIsFoundByOneRing) {
  std::mt19937 random(3);
  Mapper mapper(MappingConfig{});
  int listed = 0;
  for (double t = 0.0; t < 6.5; t += 0.1) {
    testing::World world;
    world.boxes = {{{9.0, 0.0, 1.5}, {0.1, 8.0, 1.5}}};
    if (t > 2.5) world.boxes.push_back({{5.5, t - 4.5, 0.2}, {0.3, 0.3, 0.2}});
    const double height = 1.1 - 0.2 * std::clamp(t - 1.0, 0.0, 1.0);
    listed +=
        mapper.Insert(testing::Scan(world, {0, 0, height}, t, {0.02, 0.01}, &random)).n_moving;
  }
  EXPECT_GT(listed, 5);
}

/// A mover on its way to a wall that has long been there is not forecast to go through it.
TEST(MappingMover, ForecastEndsAtAWall) {
  std::mt19937 random(3);
  Mapper mapper(MappingConfig{});
  int judged = 0;
  for (double t = 0.0; t < 5.0; t += 0.1) {
    testing::World world;
    world.boxes = {{{8.0, 0.0, 2.0}, {0.1, 6.0, 2.0}}, {{-9.0, 0.0, 2.0}, {0.1, 6.0, 2.0}}};
    if (t > 2.5) world.boxes.push_back({{2.5 + 1.2 * (t - 2.5), 2.0, 0.9}, {0.25, 0.25, 0.9}});
    const auto list = mapper.Insert(testing::Scan(world, {0, 0, 1.2}, t, {0.02, 0.01}, &random));
    for (const auto& o : list.obstacles) {
      if (!o.moving || t < 4.0) continue;
      ++judged;
      EXPECT_LT(o.center.Position(t + 3.0).x(), 8.0);
      EXPECT_GT(o.center.Position(t + 3.0).x(), 6.8);
    }
  }
  EXPECT_GE(judged, 8);
}

/// A door lets a walker through, also where he will brush its post, and so does one with a lintel
/// above his head; a wall does not.
TEST(MappingMover, ForecastGoesThroughADoor) {
  struct Case {
    const char* name;
    double left, right, lintel;  ///< posts, y; m
    bool free;
  };
  constexpr double kWall = 6.5, kTall = 4.0, kSpeed = 1.2;
  for (const Case& c :
       {Case{"door", 2.5, 1.5, kTall, true}, Case{"lintel", 2.5, 1.5, 2.1, true},
        Case{"post ahead", 3.1, 2.05, kTall, true}, Case{"wall", 2.0, 2.0, 0.0, false}}) {
    std::mt19937 random(3);
    Mapper mapper(MappingConfig{});
    int judged = 0;
    for (double t = 0.0; t < 5.0; t += 0.1) {
      const auto wall = [&](double right, double left, double bottom) {
        return testing::Box{{kWall, 0.5 * (left + right), 0.5 * (bottom + kTall)},
                            {0.1, 0.5 * (left - right), 0.5 * (kTall - bottom)}};
      };
      testing::World world;
      world.boxes = {wall(-6.0, c.right, 0.0), wall(c.left, 8.0, 0.0),
                     wall(c.right, c.left, c.lintel)};
      if (t > 2.5) world.boxes.push_back({{1.5 + kSpeed * (t - 2.5), 2.0, 0.9}, {0.25, 0.25, 0.9}});
      const auto list = mapper.Insert(testing::Scan(world, {0, 0, 1.2}, t, {0.02, 0.01}, &random));
      for (const auto& o : list.obstacles) {
        if (!o.moving || t < 4.0) continue;
        ++judged;
        const double end = o.center.Position(t + 3.0).x();
        const double way = end - o.center.Position(t).x();
        if (c.free) {
          EXPECT_GT(way, 3.0 * kSpeed - 0.6) << c.name << " " << t;
        } else {
          EXPECT_LT(end, kWall) << c.name << " " << t;
          EXPECT_GT(end, kWall - 1.2) << c.name << " " << t;
        }
      }
    }
    EXPECT_GE(judged, 8) << c.name;
  }
}

/// Who stood and begins to walk is held by something listed in every sweep: by what the map holds
/// of him, then by what stands there as far as is known, then by one mover, which he is for sure
/// once he has left his place.
TEST(MappingMover, WhoBeginsToWalkIsListedAllTheTime) {
  constexpr double kBegins = 3.0, kRadius = 0.25, kLeft = 0.9;  // s, m, m
  for (const double speed : {0.5, 1.0, 1.2})
    for (const double range : {1.5, 3.0, 6.0})
      for (const double wall : {range + 0.8, 12.0}) {
        SCOPED_TRACE(::testing::Message()
                     << speed << " m/s, " << range << " m, wall at " << wall << " m");
        std::mt19937 random(3);
        Mapper mapper(MappingConfig{});
        std::set<int> ids;
        for (double t = 0.0; t < kBegins + 2.5; t += 0.1) {
          const Eigen::Vector2d p(range, speed * std::max(0.0, t - kBegins) - 0.5);
          testing::World world;
          world.boxes = {{{wall, 0.0, 2.0}, {0.1, 9.0, 2.0}}, {{-9.0, 0.0, 2.0}, {0.1, 9.0, 2.0}}};
          world.cylinders = {{p, kRadius, 0.0, 1.75}};
          testing::Truth truth;
          const auto list =
              mapper.Insert(testing::Scan(world, {0, 0, 1.2}, t, {0.02, 0.01}, &random, &truth));
          Eigen::Vector3d seen = Eigen::Vector3d::Zero();
          int n = 0;
          for (size_t i = 0; i < truth.points.size(); ++i)
            if (truth.objects[i] == 3) seen += truth.points[i], ++n;
          EXPECT_NE(testing::Holding(list.obstacles, seen / n, t), nullptr) << t;
          for (const auto& o : list.obstacles) {
            if (!o.moving || t < kBegins + kLeft / speed) continue;
            ids.insert(o.id);
            const Eigen::Vector2d v = o.center.Velocity(t).head<2>();
            EXPECT_LT((v - Eigen::Vector2d(0.0, speed)).norm(), 0.3) << t;
            EXPECT_LT(testing::SectionRadius(o, 1.0), kRadius + 0.3) << t;
          }
          EXPECT_TRUE(t < kBegins + kLeft / speed || list.n_moving == 1) << t;
        }
        EXPECT_EQ(ids.size(), 1u);
      }
}

/// Who stood for long and walks on is the one that he was: what the map holds where he stood is his
/// own until he has left that place.
TEST(MappingMover, WhoWalksOnKeepsHisId) {
  constexpr double kStops = 3.0, kWalksOn = 9.0, kSeen = 1.0, kEnd = 13.0;  // s
  for (const double speed : {0.3, 0.45})
    for (const double turn : {0.0, 1.6}) {
      SCOPED_TRACE(::testing::Message() << speed << " m/s, turned by " << turn);
      std::mt19937 random(3);
      Mapper mapper(MappingConfig{});
      std::set<int> ids;
      for (double t = 0.0; t < kEnd; t += 0.1) {
        const Eigen::Vector2d stood(3.5, 1.0);
        const Eigen::Vector2d p =
            stood + Eigen::Vector2d(0.0, std::min(0.0, t - kStops)) +
            std::max(0.0, t - kWalksOn) * speed * Eigen::Vector2d(-std::sin(turn), std::cos(turn));
        testing::World world;
        world.boxes = {{{12.0, 0.0, 2.0}, {0.1, 9.0, 2.0}}, {{-9.0, 0.0, 2.0}, {0.1, 9.0, 2.0}}};
        world.cylinders = {{p, 0.25, 0.0, 1.75}};
        const auto list =
            mapper.Insert(testing::Scan(world, {0, 0, 1.2}, t, {0.02, 0.01}, &random));
        for (const auto& o : list.obstacles)
          if (o.moving) ids.insert(o.id);
        EXPECT_TRUE(t < kWalksOn + kSeen || list.n_moving == 1) << t;
      }
      EXPECT_EQ(ids.size(), 1u);
    }
}

TEST(MappingMover, WhatStopsBecomesStatic) {
  std::mt19937 random(3);
  Mapper mapper(MappingConfig{});
  ObstacleList list;
  const auto place = [](double t) {
    return Eigen::Vector2d(6.0, std::min(0.0, -6.0 + 2.0 * (t - kStart)));
  };
  double t = 0.0;
  for (; t < 12.0; t += 0.1) {
    testing::World world;
    world.boxes = {{{-20.0, 0, 2}, {0.1, 30, 2}}, {{15.0, 0, 2}, {0.1, 30, 2}}};
    if (t > kStart) world.boxes.push_back({{place(t).x(), place(t).y(), 1.0}, {0.5, 0.5, 1.0}});
    list = mapper.Insert(testing::Scan(world, {0, 0, 1.5}, t, {0.02, 0.01}, &random));
  }
  EXPECT_EQ(list.n_moving, 0);
  const auto* o = testing::Holding(list.obstacles, {5.5, 0.0, 1.0}, t);
  ASSERT_NE(o, nullptr);
  EXPECT_FALSE(o->moving);
}

}  // namespace
}  // namespace chase::mapping
