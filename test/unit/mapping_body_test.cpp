#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "services/mapping/body_filter.h"
#include "services/mapping/panorama.h"

namespace chase::mapping {
namespace {

constexpr double kSigma = 0.04, kUnseen = 0.5, kStep = 0.1;  // m, m, s

/// Reaches of a rectangle about `c`, all ends in view.
Reaches Box(const Eigen::Vector2d& c, const Eigen::Vector2d& half) {
  Reaches reaches;
  for (int k = 0; k < kDirections; ++k) {
    const Eigen::Vector2d d = Direction(k);
    reaches[static_cast<size_t>(k)] = {d.dot(c) + half.dot(d.cwiseAbs()), 0.0, true};
  }
  return reaches;
}

TEST(MappingBody, VelocityIsThatOfTheBodyAndItsVarianceIsHonest) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0.0, 0.03);
  const Eigen::Vector2d v(1.7, -2.1);
  double nees = 0.0;
  int n = 0;
  for (int flight = 0; flight < 20; ++flight) {
    BodyFilter body;
    for (int i = 0; i < 40; ++i) {
      Reaches seen = Box(i * kStep * v, {1.5, 0.6});
      for (auto& reach : seen) reach.along += normal(random);
      if (i == 0) {
        body = BodyFilter({0.0, 0.0}, seen, 2.5, kUnseen);
        continue;
      }
      body.Predict(kStep, {});
      body.Correct(seen, kSigma, kUnseen);
      if (i < 15) continue;
      EXPECT_LT((body.v() - v).norm(), 0.3) << flight << " " << i;
      nees += 0.5 * (body.v() - v).squaredNorm() / body.VelocityVariance();
      ++n;
    }
  }
  EXPECT_LT(nees / n, 1.0);
}

/// A walker that turns back is believed within three sweeps, and mostly followed to 0.3 m/s, and
/// the variance says so until then.
TEST(MappingBody, AReversalIsFollowedAndItsVarianceIsHonest) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, 0.02);
  const MotionNoise motion{0.4, 0.2, 1.0};
  constexpr double kAge = 0.08;  // s, of the returns
  int followed = 0;
  for (int flight = 0; flight < 20; ++flight) {
    const double v = 0.6 + 0.04 * flight, changed = 1.95 + 0.004 * flight;  // m/s, s
    BodyFilter body;
    for (int i = 0; i < 24; ++i) {
      const double t = i * kStep - kAge, x = v * (t - 2.0 * std::max(0.0, t - changed));
      Reaches seen = Box({x, 0.0}, {0.25, 0.25});
      for (auto& reach : seen) reach.along += normal(random), reach.age = kAge;
      if (i == 0) body = BodyFilter({0.0, 0.0}, seen, 2.5, kUnseen);
      if (i == 0) continue;
      body.Predict(kStep, motion);
      body.Correct(seen, kSigma, kUnseen);
      if (i == 20) {
        EXPECT_NEAR(body.v().x(), v, 0.3);
      }
    }
    const double error = std::abs(body.v().x() + v);
    followed += error < 0.3;
    EXPECT_LT(error, v) << flight;  // nearer to the new velocity than to the old one
    EXPECT_LT(error, 3.0 * std::sqrt(body.VelocityVariance())) << flight;
  }
  EXPECT_GE(followed, 16);
}

/// A body at rest, or under way, of which more and more comes into view.
TEST(MappingBody, WhatComesIntoViewIsNoMotion) {
  for (const double speed : {0.0, 2.0}) {
    BodyFilter body;
    for (int i = 0; i < 30; ++i) {
      const double hidden = std::max(0.0, 2.0 - 0.1 * i);  // m of 3 m, at the rear
      Reaches seen = Box({speed * kStep * i + 0.5 * hidden, 0.0}, {1.5 - 0.5 * hidden, 0.6});
      for (int k = 0; k < kDirections; ++k)
        if (Direction(k).x() < -0.01) seen[static_cast<size_t>(k)].edge = hidden <= 0.0;
      if (i == 0) {
        body = BodyFilter({0.0, 0.0}, seen, 2.5, kUnseen);
        continue;
      }
      body.Predict(kStep, {});
      EXPECT_GE(body.Correct(seen, kSigma, kUnseen).ends, 9);
      if (i > 5) {
        EXPECT_NEAR(body.v().x(), speed, 0.1) << i;
      }
    }
    const Rectangle box = SmallestRectangle(ConvexHull(body.Outline()));
    EXPECT_NEAR(box.half.x(), 1.5, 0.15);
    EXPECT_NEAR(box.half.y(), 0.6, 0.15);
  }
}

/// A trunk hides first the front, then the rear of a body that passes behind it.
TEST(MappingBody, WhatWasHiddenAndIsBackIsNoMotion) {
  constexpr double kSpeed = 3.0;
  BodyFilter body;
  for (int i = 0; i < 50; ++i) {
    const double x = kSpeed * kStep * i;
    double front = 1.5, rear = -1.5;
    if (i >= 20 && i < 26) front = -0.2;
    if (i >= 26 && i < 32) rear = 0.2;
    Reaches seen = Box({x + 0.5 * (front + rear), 0.0}, {0.5 * (front - rear), 0.6});
    for (int k = 0; k < kDirections; ++k) {
      const double dx = Direction(k).x();
      if ((dx > 0.01 && front < 1.5) || (dx < -0.01 && rear > -1.5))
        seen[static_cast<size_t>(k)].edge = false;
    }
    if (i == 0) {
      body = BodyFilter({0.0, 0.0}, seen, 2.5, kUnseen);
      continue;
    }
    body.Predict(kStep, {});
    body.Correct(seen, kSigma, kUnseen);
    if (i > 10) {
      EXPECT_NEAR(body.v().x(), kSpeed, 0.1) << i;
    }
  }
}

/// Found again from another side its place is as uncertain as its reaches are; that its ends move
/// together shows all the same.
TEST(MappingBody, EndsFoundAgainMoveAsOneBody) {
  BodyFilter body;
  for (int i = 0; i < 30; ++i) {
    Reaches seen = Box({0.08 * i, 0.0}, {0.3, 0.3});
    for (int k = 0; k < kDirections; ++k)
      seen[static_cast<size_t>(k)].edge = (i < 4 ? 1.0 : -1.0) * Direction(k).y() > 0.5;
    if (i == 0) body = BodyFilter({0.0, 0.0}, seen, 2.5, kUnseen);
    if (i == 0) continue;
    body.Predict(kStep, {0.4, 0.2, 1.0});
    if (i >= 4 && i < 14) continue;  // out of sight
    const Sight sight = body.Correct(seen, kSigma, kUnseen);
    if (i > 14) {
      EXPECT_EQ(sight.rigid, sight.ends) << i;
    }
  }
}

TEST(MappingBody, AnEndThatJumpsIsAnotherOutline) {
  BodyFilter body({0.0, 0.0}, Box({0.0, 0.0}, {1.0, 0.5}), 2.5, kUnseen);
  for (int i = 1; i < 40; ++i) {
    body.Predict(kStep, {});
    Reaches seen = Box({0.0, 0.0}, {1.0, 0.5});
    if (i >= 20) seen[0].along += 0.8;  // something joins in front
    body.Correct(seen, kSigma, kUnseen);
    if (i > 5) {
      EXPECT_LT(body.v().norm(), 0.15) << i;
    }
  }
}

/// What a body passes is not its own where its end has been in view; elsewhere it may be.
TEST(MappingBody, OutlineHardlyGrowsBeyondAnEndThatWasInView) {
  for (const bool known : {false, true}) {
    BodyFilter body;
    for (int i = 0; i < 30; ++i) {
      Reaches seen = Box({0.15 * i, 0.0}, {0.5, 0.4});
      for (int k = 0; k < kDirections;
           ++k) {  // from the twentieth sweep on it touches a wall in front
        const double front = std::max(0.0, Direction(k).x());
        if (i >= 20) seen[static_cast<size_t>(k)].along += 3.0 * front;
        seen[static_cast<size_t>(k)].edge = front < 0.01 || (known && i < 20);
      }
      if (i == 0) {
        body = BodyFilter({0.0, 0.0}, seen, 2.5, kUnseen);
        continue;
      }
      body.Predict(kStep, {});
      body.Correct(seen, kSigma, kUnseen);
      if (i > 5) {
        EXPECT_NEAR(body.v().x(), 1.5, 0.1) << i;
      }
    }
    double reach = 0.0;
    for (const auto& q : body.Outline()) reach = std::max(reach, q.x());
    if (known)
      EXPECT_LT(reach, 0.5 + 0.45);
    else
      EXPECT_GT(reach, 0.5 + 2.5);
  }
}

TEST(MappingBody, OnlyEndsThatMoveTogetherAreRigid) {
  const Eigen::Vector2d half(0.8, 0.5);
  BodyFilter body({0.0, 0.0}, Box({0.0, 0.0}, half), 2.5, kUnseen);
  body.Predict(kStep, {});
  EXPECT_EQ(body.Correct(Box({0.2, 0.0}, half), kSigma, kUnseen).rigid, kDirections);

  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(-1.5, 1.5);
  for (int i = 0; i < 20; ++i) {
    body.Predict(kStep, {});
    Reaches seen = Box({0.2 * i, 0.0}, half);
    for (auto& reach : seen) reach.along += anywhere(random);
    const Sight sight = body.Correct(seen, kSigma, kUnseen);
    EXPECT_EQ(sight.ends, kDirections);
    if (i > 0) {
      EXPECT_LT(sight.rigid, 6) << i;
    }
  }
}

TEST(MappingBody, AgesOfReturnsAreTakenBack) {
  const Eigen::Vector2d v(4.0, 0.0);
  BodyFilter body;
  for (int i = 0; i < 30; ++i) {
    Reaches seen = Box((i * kStep - 0.05) * v, {1.0, 0.5});
    for (auto& reach : seen) reach.age = 0.05;
    if (i == 0) body = BodyFilter({0.0, 0.0}, seen, 2.5, kUnseen);
    if (i == 0) continue;
    body.Predict(kStep, {});
    body.Correct(seen, kSigma, kUnseen);
  }
  Eigen::Vector2d center = body.p() + SmallestRectangle(ConvexHull(body.Outline())).center;
  EXPECT_NEAR(center.x(), 29 * kStep * v.x(), 0.12);
}

TEST(MappingBody, OutlineOfReachesThatContradictIsEmpty) {
  Reaches seen = Box({0.0, 0.0}, {1.0, 1.0});
  seen[0].along = -3.0;
  EXPECT_TRUE(BodyFilter({0.0, 0.0}, seen, 1.0, kUnseen).Outline().empty());
}

TEST(MappingPanorama, HidesWhatIsBehindAndNotWhatIsBeside) {
  std::vector<Return> returns(2);
  returns[0].p = {4.0f, 0.0f, 1.0f};
  returns[1].p = {0.0f, 9.0f, 1.0f};
  for (int i = 0; i < 2000; ++i) {  // a wall all around, but for some directions without a return
    const float a = 2e-3f * static_cast<float>(M_PI) * static_cast<float>(i) / 2.0f;
    if (i > 1000 && i < 1100) continue;
    returns.emplace_back().p = {20.0f * std::cos(a), 20.0f * std::sin(a), 1.0f};
  }
  std::vector<int> owner(returns.size(), -1);
  owner[1] = 2;
  Panorama panorama;
  EXPECT_FALSE(panorama.Hides({8.0, 0.0, 0.5}, -3));  // before the first sweep
  panorama.Take({0.0, 0.0, 1.5}, {}, returns, owner);
  EXPECT_TRUE(panorama.Hides({8.0, 0.0, 0.5}, 0));
  EXPECT_TRUE(panorama.Hides({8.0, 0.1, 0.5}, 0));
  EXPECT_FALSE(panorama.Hides({8.0, 0.0, 1.6}, 0));  // looks over it
  EXPECT_FALSE(panorama.Hides({8.0, 1.0, 0.5}, 0));
  EXPECT_FALSE(panorama.Hides({3.9, 0.0, 0.5}, 0));
  EXPECT_TRUE(panorama.Hides({0.0, 12.0, 1.2}, 1));
  EXPECT_FALSE(panorama.Hides({0.0, 12.0, 1.2}, 2));  // its own returns
  EXPECT_FALSE(panorama.Hides({0.0, 0.0, 1.5}, 0));
  EXPECT_TRUE(panorama.Hides({-5.0, -0.8, 1.2}, 0));  // what is too near for a return
  EXPECT_FALSE(panorama.Hides({-5.0, 0.8, 1.2}, 0));
}

/// A full turn of either sense from any start, seen from a tilted sensor.
TEST(MappingSweep, AgesFollowTheTurn) {
  const Eigen::Vector3d origin(3.0, -2.0, 1.0);
  for (const double sense : {-1.0, 1.0}) {
    for (const double yaw : {0.0, 2.0, -3.0}) {
      const Eigen::Quaterniond R(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()));
      std::vector<Eigen::Vector3f> points;
      for (int i = 0; i <= 720; ++i) {
        const double a = 1.0 + sense * i * M_PI / 360.0;
        const Eigen::Vector3d ray(5.0 * std::cos(a), 5.0 * std::sin(a), i % 16 - 8.0);
        points.push_back((origin + R * ray).cast<float>());
      }
      const auto ages = FiringAges(origin, R, points, 0.1);
      for (int i = 0; i <= 720; i += 40)
        EXPECT_NEAR(ages[static_cast<size_t>(i)], 0.1 * (1.0 - i / 720.0), 1e-3) << sense << yaw;
    }
  }
}

TEST(MappingSweep, ReturnsInNoOrderHaveNoAges) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> place(-9.0f, 9.0f);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 500; ++i) points.emplace_back(place(random), place(random), 1.0f);
  points[7].x() = NAN;
  for (const float age : FiringAges({0, 0, 0}, Eigen::Quaterniond::Identity(), points, 0.1))
    EXPECT_EQ(age, 0.0f);
  EXPECT_TRUE(FiringAges({0, 0, 0}, Eigen::Quaterniond::Identity(), {}, 0.1).empty());
}

}  // namespace
}  // namespace chase::mapping
