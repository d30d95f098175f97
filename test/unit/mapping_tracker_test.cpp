#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "services/mapping/tracker.h"

namespace chase::mapping {
namespace {

/// What is seen of a square, all of whose ends are in view or none.
Cluster BoxCluster(const Eigen::Vector2d& center, double half, bool ends = true) {
  Cluster cluster;
  cluster.members = {0};
  for (int k = 0; k < kDirections; ++k) {
    const Eigen::Vector2d d = Direction(k);
    cluster.reaches[static_cast<size_t>(k)] = {d.dot(center) + half * d.lpNorm<1>(), 0.0, ends};
  }
  cluster.center << center, 1.0;
  return cluster;
}

/// Two movers whose paths cross at the same time, 1.2 m apart there, with noisy centres.
struct Crossing {
  Eigen::Vector2d First(double t) const { return {-4.0 + 2.0 * t, -0.6 + 0.3 * (t - 2.0)}; }
  Eigen::Vector2d Second(double t) const { return {4.0 - 2.0 * t, 0.6 - 0.3 * (t - 2.0)}; }
};

TEST(MappingTracker, IdsSurviveACrossing) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0.0, 0.05);
    Tracker tracker(MoverConfig{});
    const Crossing crossing;
    std::map<int, int> first, second;
    for (double t = 0.0; t < 4.0; t += 0.1) {
      tracker.Predict(t);
      const Eigen::Vector2d noise(normal(random), normal(random));
      std::vector<Cluster> clusters = {BoxCluster(crossing.Second(t) - noise, 0.4),
                                       BoxCluster(crossing.First(t) + noise, 0.4)};
      tracker.Update(Panorama(), &clusters);
      ASSERT_EQ(clusters.size(), 2u) << "seed " << seed << " t " << t;
      ++second[clusters[0].track];
      ++first[clusters[1].track];
    }
    EXPECT_EQ(first.size(), 1u) << "seed " << seed;
    EXPECT_EQ(second.size(), 1u) << "seed " << seed;
    for (const auto& o : tracker.Obstacles(1.5, 8.0, 1.0))
      EXPECT_NEAR(std::abs(o.center.Velocity(4.0).x()), 2.0, 0.3);
  }
}

/// A wall at 2 m, seen from (0, -4), on both sides of a gap at `gap`, and what lies beyond the gap.
Panorama Seen(double gap) {
  std::vector<Return> returns;
  for (double angle = -1.2; angle < 1.2; angle += 0.002) {
    const bool open = std::abs(std::tan(angle) * 2.0 - gap) < 0.3;
    const double range = open ? 12.0 : 2.0 / std::cos(angle);
    Return r;
    r.p =
        Eigen::Vector3d(range * std::sin(angle), range * std::cos(angle) - 4.0, 1.0).cast<float>();
    returns.push_back(r);
  }
  Panorama panorama;
  panorama.Take({0.0, -4.0, 1.0}, {}, returns, std::vector<int>(returns.size(), -1));
  return panorama;
}

/// From (0, -2) and this height into the open, no ray lower than `low` where y is 0.
Panorama SeenFrom(double height, double low) {
  std::vector<Return> returns;
  for (double angle = -1.4; angle < 1.4; angle += 0.002)
    for (const double rise : {0.0, 0.5}) {
      const double far = 5.0, slope = (low + rise - height) * std::cos(angle) / 2.0;
      Return r;
      r.p =
          Eigen::Vector3d(far * std::sin(angle), far * std::cos(angle) - 2.0, height + far * slope)
              .cast<float>();
      returns.push_back(r);
    }
  Panorama panorama;
  panorama.Take({0.0, -2.0, height}, {}, returns, std::vector<int>(returns.size(), -1));
  return panorama;
}

/// What something hides is not missed: it stays listed, ever less certain where; what is nowhere to
/// be seen although its place is in view is not.
TEST(MappingTracker, OnlyWhatIsHiddenStaysListed) {
  for (const bool hidden : {true, false}) {
    Tracker tracker(MoverConfig{});
    int id = -1;
    double sigma = 0.0;
    for (double t = 0.0; t < 4.0; t += 0.1) {
      tracker.Predict(t);
      std::vector<Cluster> clusters;
      if (t < 1.5 || t > 2.8) clusters.push_back(BoxCluster({1.5 * t - 4.0, 0.0}, 0.5));
      const bool away = t > 1.5 && t < 2.8;
      tracker.Update(away && hidden ? Seen(50.0) : Panorama(), &clusters);
      const auto obstacles = tracker.Obstacles(1.5, 8.0, 1.0);
      if (t > 0.9 && t < 1.4) id = clusters[0].track;
      if (t > 1.85 && t < 2.75) {
        ASSERT_EQ(obstacles.size(), hidden ? 1u : 0u) << t;
        if (!hidden) continue;
        EXPECT_EQ(obstacles[0].id, id);
        EXPECT_LT(obstacles[0].existence, 1.0);
        EXPECT_GT(obstacles[0].position_covariance(0, 0), sigma);
        sigma = obstacles[0].position_covariance(0, 0);
      }
      if (t > 2.9 && hidden) {
        EXPECT_EQ(clusters[0].track, id) << t;
      }
    }
  }
}

/// What all rays pass over is not missed either: a walker under the drone.
TEST(MappingTracker, WhatRaysPassOverStaysListed) {
  for (const double low : {0.9, 1.8}) {
    Tracker tracker(MoverConfig{});
    for (double t = 0.0; t < 6.0; t += 0.1) {
      tracker.Predict(t);
      std::vector<Cluster> clusters;
      if (t < 1.5) clusters.push_back(BoxCluster({1.5 * t - 2.0, 0.0}, 0.5));
      tracker.Update(t > 1.5 ? SeenFrom(2.4, low) : Panorama(), &clusters);
      if (t > 1.0 && t < 1.5) {
        ASSERT_EQ(tracker.Obstacles(1.5, 8.0, 1.0).size(), 1u) << t;
      }
      if (t > 2.0 && (t < 4.1 || t > 4.5)) {  // exp(-t / lifetime) is a half after 2.8 s
        EXPECT_EQ(tracker.Obstacles(1.5, 8.0, 1.0).size(), low > 1.5 && t < 4.3 ? 1u : 0u) << t;
      }
    }
  }
}

/// From (0, -0.6): a wall at 5 m, but no return at all where a walker at (0, 0) is too near for the
/// sensor to range it.
Panorama TooNear() {
  std::vector<Return> returns;
  for (double angle = -3.1; angle < 3.1; angle += 0.003) {
    if (std::abs(angle) < std::asin(0.25 / 0.6)) continue;
    Return r;
    r.p = Eigen::Vector3d(5.0 * std::sin(angle), 5.0 * std::cos(angle) - 0.6, 1.0).cast<float>();
    returns.push_back(r);
  }
  Panorama panorama;
  panorama.Take({0.0, -0.6, 1.2}, {}, returns, std::vector<int>(returns.size(), -1));
  return panorama;
}

/// Nothing tells of what is nearer than the sensor can see: it is not missed.
TEST(MappingTracker, WhatIsTooNearStaysListed) {
  Tracker tracker(MoverConfig{});
  for (double t = 0.0; t < 3.5; t += 0.1) {
    tracker.Predict(t);
    std::vector<Cluster> clusters;
    if (t < 1.5) clusters.push_back(BoxCluster({std::min(0.0, 1.0 * t - 1.5), 0.0}, 0.25));
    tracker.Update(t > 1.5 ? TooNear() : Panorama(), &clusters);
    if (t > 1.0) {
      ASSERT_EQ(tracker.Obstacles(1.5, 8.0, 1.0).size(), 1u) << t;
    }
  }
}

TEST(MappingTracker, WhatStandsIsNeverListed) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0.0, 0.05);
  Tracker tracker(MoverConfig{});
  for (double t = 0.0; t < 20.0; t += 0.1) {
    tracker.Predict(t);
    std::vector<Cluster> clusters = {BoxCluster({3.0 + normal(random), normal(random)}, 0.3)};
    tracker.Update(Panorama(), &clusters);
    EXPECT_TRUE(tracker.Obstacles(1.5, 8.0, 1.0).empty()) << t;
  }
}

/// What is seen now and then only may be anything.
TEST(MappingTracker, DetectionsWithGapsMakeNoMover) {
  Tracker tracker(MoverConfig{});
  for (int i = 0; i < 60; ++i) {
    tracker.Predict(0.1 * i);
    std::vector<Cluster> clusters;
    if (i >= 40 || i % 3 != 2) clusters.push_back(BoxCluster({0.2 * i, 0.0}, 0.5));
    tracker.Update(Panorama(), &clusters);
    if (i < 40) {
      EXPECT_TRUE(tracker.Obstacles(1.5, 8.0, 1.0).empty()) << i;
    }
  }
  EXPECT_EQ(tracker.Obstacles(1.5, 8.0, 1.0).size(), 1u);
}

/// A mover out of sight could be almost anywhere: that makes it no likelier to be what is seen
/// where another mover is expected.
TEST(MappingTracker, WhatIsOutOfSightTakesNoPlaceOfWhatIsInSight) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0.0, 0.06);
    Tracker tracker(MoverConfig{});
    int id = -1;
    for (double t = 0.0; t < 3.5; t += 0.1) {
      tracker.Predict(t);
      const Eigen::Vector2d noise(normal(random), normal(random));
      std::vector<Cluster> clusters = {BoxCluster(Eigen::Vector2d(2.0 * t, 0.0) + noise, 0.5)};
      if (t < 1.5) clusters.push_back(BoxCluster({2.0 * t, 5.1 - 1.6 * t}, 0.5));
      tracker.Update(Panorama(), &clusters);
      if (t < 1.5)
        id = clusters[0].track;
      else
        EXPECT_EQ(clusters[0].track, id) << "seed " << seed << " t " << t;
    }
  }
}

/// Foliage and glass: returns where space seemed free, now from this part, now from that. The
/// middle moves on, but nothing moves as one body.
TEST(MappingTracker, PartsThatChangeMakeNoMover) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> part(-0.6, 0.6);
    Tracker tracker(MoverConfig{});
    for (int i = 0; i < 60; ++i) {
      tracker.Predict(0.1 * i);
      std::vector<Cluster> clusters = {BoxCluster({0.1 * i, 0.0}, 0.8)};
      for (auto& reach : clusters[0].reaches) reach.along += part(random);
      tracker.Update(Panorama(), &clusters);
      EXPECT_TRUE(tracker.Obstacles(1.5, 8.0, 1.0).empty()) << "seed " << seed << " sweep " << i;
    }
  }
}

/// Two walkers so near to each other that their returns are connected.
TEST(MappingDetector, ConnectedReturnsAreDividedBetweenTheExpectedBodies) {
  VoxelGrid grid(0.2);
  grid.MoveTo(Eigen::Vector3d::Zero());
  std::vector<Return> returns;
  std::vector<Footprint> expected(2);
  for (int body = 0; body < 2; ++body) {
    const Eigen::Vector2d c(5.0, 0.55 * body);
    auto& f = expected[static_cast<size_t>(body)];
    f.track = 7 + body;
    f.p = c;
    f.reach.fill(0.25);
    f.sigma.fill(0.08);
    f.radius = 0.7;
    for (int i = 0; i < 40; ++i) {
      const double a = M_PI * (0.5 + i / 40.0);
      const Eigen::Vector3d p(c.x() + 0.25 * std::cos(a), c.y() + 0.25 * std::sin(a), 1.0);
      returns.push_back({p.cast<float>(), grid.ToKey(p)});
    }
  }
  for (int i = 0; i < 1000; ++i) {  // the ground far away
    const Eigen::Vector3d p(18.0 * std::cos(0.01 * i), 18.0 * std::sin(0.01 * i), 0.0);
    returns.push_back({p.cast<float>(), grid.ToKey(p), Label::kGround});
  }
  MotionDetector detector(MoverConfig{}, GridConfig{});
  auto clusters = detector.Detect({0.0, 0.0, 1.0}, {}, returns, &grid, expected);
  ASSERT_EQ(clusters.size(), 2u);
  for (const auto& cluster : clusters) {
    EXPECT_EQ(cluster.members.size(), 40u);
    for (const int i : cluster.members) EXPECT_EQ(cluster.track, 7 + i / 40);
  }
  // One body of that size that was seen as both before is two: nothing hides what is between them.
  for (auto& r : returns)
    if (r.label == Label::kStatic && r.p.y() > 0.3f) r.p.y() += 0.5f;
  expected.resize(1);
  expected[0].p.y() = 0.5;
  expected[0].reach.fill(1.0);
  expected[0].radius = 2.0;
  clusters = detector.Detect({0.0, 0.0, 1.0}, {}, returns, &grid, expected);
  EXPECT_EQ(clusters.size(), 2u);
}

TEST(MappingDetector, WhatLiesBesideAnExpectedPlaceDoesNotJoin) {
  VoxelGrid grid(0.2);
  grid.MoveTo(Eigen::Vector3d::Zero());
  std::vector<Return> returns;
  const auto add = [&](double x) {
    for (int i = 0; i < 12; ++i) {
      const Eigen::Vector3d p(x, 0.02 * i, 1.0 + 0.02 * i);
      returns.push_back({p.cast<float>(), grid.ToKey(p)});
    }
  };
  add(5.3);
  add(5.65);  // in the next cell of the clusters
  Footprint expected;
  expected.p = {5.0, 0.0};
  expected.reach.fill(0.5);
  expected.sigma.fill(0.01);
  expected.radius = 1.0;
  MotionDetector detector(MoverConfig{}, GridConfig{});
  const auto clusters = detector.Detect({0.0, 0.0, 1.0}, {}, returns, &grid, {expected});
  ASSERT_EQ(clusters.size(), 1u);
  EXPECT_EQ(clusters[0].members.size(), 12u);
}

/// What lies where a mover was expected, and shows no end, keeps no track alive.
TEST(MappingTracker, WhatShowsNoEndIsNoSight) {
  Tracker tracker(MoverConfig{});
  for (double t = 0.0; t < 6.0; t += 0.1) {
    tracker.Predict(t);
    std::vector<Cluster> clusters = {BoxCluster({1.5 * t, 0.0}, 0.5, t < 1.5)};
    tracker.Update(Panorama(), &clusters);
    if (t > 1.0 && t < 1.4) {
      EXPECT_EQ(tracker.Obstacles(1.5, 8.0, 1.0).size(), 1u) << t;
    }
    if (t > 2.2) {
      EXPECT_TRUE(tracker.Obstacles(1.5, 8.0, 1.0).empty()) << t;
    }
  }
}

/// One of two that walk side by side is hidden by a wall. The other one, near enough to be taken
/// for it, is in view: that tells nothing of it.
TEST(MappingTracker, WhatIsSeenOfAnotherTellsNothingOfWhatIsHidden) {
  for (const double apart : {0.45, 0.5, 0.6}) {
    Tracker tracker(MoverConfig{});
    for (double t = 0.0; t < 3.0; t += 0.1) {
      tracker.Predict(t);
      const bool hidden = t > 1.45;
      std::vector<Cluster> clusters = {BoxCluster({1.5 * t - 3.0, 0.0}, 0.2)};
      if (!hidden) clusters.push_back(BoxCluster({1.5 * t - 3.0, apart}, 0.2));
      tracker.Update(hidden ? Seen(-9.0) : Panorama(), &clusters);
      if (t < 1.0) continue;
      EXPECT_EQ(tracker.Obstacles(1.5, 8.0, 1.0).size(), 2u) << apart << " " << t;
    }
  }
}

TEST(MappingTracker, HalvesOfOneMoverAreOneTrack) {
  Tracker tracker(MoverConfig{});
  for (double t = 0.0; t < 3.0; t += 0.1) {
    tracker.Predict(t);
    std::vector<Cluster> clusters = {BoxCluster({2.0 * t - 0.6, 0.0}, 0.5)};
    if (t < 1.5)
      clusters.push_back(BoxCluster({2.0 * t + 0.6, 0.0}, 0.5));
    else  // the gap closes
      clusters = {BoxCluster({2.0 * t, 0.0}, 1.1)};
    tracker.Update(Panorama(), &clusters);
  }
  const auto obstacles = tracker.Obstacles(1.5, 8.0, 1.0);
  ASSERT_EQ(obstacles.size(), 1u);
  EXPECT_NEAR(obstacles[0].center.Velocity(3.0).x(), 2.0, 0.2);
}

TEST(MappingTracker, NumberOfTracksIsBounded) {
  Tracker tracker(MoverConfig{});
  std::vector<Cluster> clusters;
  for (int i = 0; i < 500; ++i) clusters.push_back(BoxCluster({10.0 * i, 0.0}, 0.3));
  tracker.Predict(0.0);
  tracker.Update(Panorama(), &clusters);
  EXPECT_LE(tracker.tracks().size(), 64u);
}

}  // namespace
}  // namespace chase::mapping
