// Things that look just like the target: what drives is the target, what stands is not.
#include <gtest/gtest.h>

#include <cmath>

#include "perception_world.h"

namespace chase::perception {
namespace {

using Eigen::Vector3d;
using perception_test::Body;
using perception_test::Fly;
using perception_test::FlyOptions;
using perception_test::kOrange;
using perception_test::Outcome;
using perception_test::StillWorld;
using perception_test::Thing;
using perception_test::World;

double Error(const Outcome& o) { return (o.estimate.p_WT - o.truth).norm(); }
bool Detected(const Outcome& o) {
  return o.estimate.state == TargetState::kTracking && o.estimate.box.width > 0.0;
}
bool Inside(const Outcome& o, double gate) {
  const Vector3d e = o.estimate.p_WT - o.truth;
  return e.dot(o.estimate.covariance.ldlt().solve(e)) < gate;
}

/// Just like the target.
Thing Twin(double x, double y) {
  return {Thing::Kind::kCylinder, {x, y, 0.55}, {0.15, 0.15, 0.25}, kOrange};
}

PerceptionConfig TakenAfterASecond() {
  PerceptionConfig config;
  config.state.standing_after = 1.0;
  return config;
}

TEST(PerceptionAlike, WhatStandsIsTakenAfterAWhile) {
  FlyOptions options;
  options.duration = 1.5;
  const PerceptionConfig config = TakenAfterASecond();
  for (const auto& o : Fly(StillWorld(2.5), config, options)) {
    if (o.t < config.state.standing_after) {
      EXPECT_EQ(o.estimate.state, TargetState::kSearching) << o.t;
      EXPECT_GT(o.estimate.covariance(0, 0), 100.0) << o.t;
    }
    if (o.t > config.state.standing_after + 0.15) {
      EXPECT_TRUE(Detected(o) && Error(o) < 0.1) << o.t;
    }
  }
}

/// A trunk hides a part of it, so that its outline is another.
TEST(PerceptionAlike, WhatStandsHalfHiddenIsTakenWhereLidarTellsItsRange) {
  for (const double aside : {0.159, 0.202}) {
    World w = StillWorld(3.5);
    w.things.push_back(
        {Thing::Kind::kCylinder, {2.0, aside, 1.0}, {0.15, 0.15, 1.0}, {0.36, 0.28, 0.21}});
    FlyOptions options;
    options.duration = 2.0;
    for (const auto& o : Fly(w, TakenAfterASecond(), options)) {
      EXPECT_GT(o.visible_share, 0.45) << "else this shows nothing";
      EXPECT_LT(o.visible_share, 0.9) << "else this shows nothing";
      if (o.t > 1.5) {
        EXPECT_TRUE(Detected(o) && Error(o) < 0.1) << "aside " << aside << ", t " << o.t;
      }
    }
  }
}

/// LiDAR rays beside it see the ground behind it, where the rest of a target would be.
TEST(PerceptionAlike, WhatIsHalfAsWideAndNothingHidesIsNotTaken) {
  World w = StillWorld(3.5);
  w.target = [](double) { return Vector3d(-8.0, 0.0, 0.55); };  // behind the drone
  w.things.push_back({Thing::Kind::kBox, {3.5, 0.0, 0.55}, {0.08, 0.08, 0.25}, kOrange});
  FlyOptions options;
  options.duration = 2.5;
  for (const auto& o : Fly(w, TakenAfterASecond(), options))
    EXPECT_NE(o.estimate.state, TargetState::kTracking) << o.t;
}

TEST(PerceptionAlike, WhatDrivesIsTakenAtOnce) {
  for (const double heading : {0.0, 0.8, 1.6, 2.4, 3.1}) {
    World w = StillWorld(3.0);
    w.target = [heading](double t) {
      return Vector3d(3.0 + 0.8 * t * std::cos(heading), 0.8 * t * std::sin(heading), 0.55);
    };
    FlyOptions options;
    options.duration = 0.8;
    for (const auto& o : Fly(w, {}, options))
      if (o.t > 0.5) {
        EXPECT_TRUE(Detected(o) && Error(o) < 0.15) << "heading " << heading << ", t " << o.t;
      }
  }
}

TEST(PerceptionAlike, OfTwoAlikeTheOneThatDrivesIsTheTarget) {
  World w = StillWorld(3.0);  // the twin is nearer the middle; the target starts at 1.5 s
  w.things.push_back(Twin(3.0, 0.1));
  w.target = [](double t) { return Vector3d(3.2, -0.9 - 0.6 * std::max(0.0, t - 1.5), 0.55); };
  FlyOptions options;
  options.duration = 2.6;
  int tracked = 0;
  for (const auto& o : Fly(w, TakenAfterASecond(), options)) {
    if (o.t < 2.3) continue;
    tracked += Detected(o);
    EXPECT_LT(Error(o), 0.2) << o.t;
  }
  EXPECT_GE(tracked, 5);
}

/// The target comes from behind a wall when its twin, which stands beside it, has been taken.
TEST(PerceptionAlike, WhatStoodWhenItWasTakenGivesWayToWhatDrives) {
  World w = StillWorld(3.5);
  w.things.push_back({Thing::Kind::kBox, {2.2, -0.8, 1.0}, {0.05, 0.6, 1.0}, {0.5, 0.6, 0.7}});
  w.things.push_back(Twin(3.2, 0.9));
  w.target = [](double t) { return Vector3d(3.5, -1.3 + 0.8 * std::max(0.0, t - 1.5), 0.55); };
  FlyOptions options;
  options.duration = 3.6;
  bool twin = false;
  double back_since = -1.0, found = -1.0;
  for (const auto& o : Fly(w, TakenAfterASecond(), options)) {
    twin = twin || (o.visible_share == 0.0 && Detected(o) && Error(o) > 1.0);
    if (back_since < 0.0 && o.visible_share >= 0.5) back_since = o.t;
    if (found < 0.0 && back_since > 0.0 && Detected(o) && Error(o) < 0.2) found = o.t;
    if (found > 0.0 && o.visible_share >= 0.5) {
      EXPECT_LT(Error(o), 0.2) << o.t;
    }
  }
  EXPECT_TRUE(twin) << "else this shows nothing";
  ASSERT_GT(found, 0.0);
  EXPECT_LE(found, back_since + 0.35);
}

/// After 2.5 s behind a wall the target comes out so slowly that it is half hidden for long.
TEST(PerceptionAlike, HalfOfATargetThatDrivesIsEnoughToFindItAgain) {
  World w = StillWorld(3.0);
  w.things.push_back({Thing::Kind::kBox, {2.2, 0.0, 1.0}, {0.05, 0.55, 1.0}, {0.5, 0.6, 0.7}});
  w.target = [](double t) {
    const double driven = 0.8 * std::min(t, 2.0) + 0.25 * std::max(0.0, t - 2.0);
    return Vector3d(3.0, -1.3 + driven, 0.55);
  };
  FlyOptions options;
  options.duration = 6.0;
  double half = -1.0, whole = -1.0, found = -1.0;
  bool hidden = false;
  for (const auto& o : Fly(w, {}, options)) {
    hidden = hidden || o.visible_share == 0.0;
    if (!hidden) continue;
    if (half < 0.0 && o.visible_share >= 0.5) half = o.t;
    if (whole < 0.0 && o.visible_share > 0.98) whole = o.t;
    if (found < 0.0 && Detected(o)) found = o.t;
    if (Detected(o)) {
      EXPECT_LT(Error(o), 0.2) << o.t;
    }
  }
  ASSERT_GT(whole, half + 0.5) << "else this shows nothing";
  ASSERT_GT(found, 0.0);
  EXPECT_LE(found, half + 0.4) << "it has driven 0.15 m by then";
}

/// A wall hides the target, which stops behind it for 3 s and goes on; a twin stands in view.
TEST(PerceptionAlike, ALongStopBehindAWallIsEndedByTheTargetAndNotByItsTwin) {
  World w = StillWorld(3.5);
  w.things.push_back({Thing::Kind::kBox, {2.2, 0.0, 1.0}, {0.05, 0.55, 1.0}, {0.5, 0.6, 0.7}});
  w.things.push_back(Twin(4.2, 1.75));
  w.target = [](double t) {
    const double driven = std::min(t, 1.8) + std::max(0.0, t - 4.8);
    return Vector3d(3.5, -1.35 + 0.8 * driven, 0.55);
  };
  FlyOptions options;
  options.duration = 7.2;
  double back_since = -1.0, found = -1.0;
  int hidden = 0, said = 0;
  for (const auto& o : Fly(w, {}, options)) {
    if (o.t < 0.5) continue;
    if (Detected(o)) {
      EXPECT_LT(Error(o), 0.3) << o.t;
    }
    if (o.visible_share == 0.0) {
      ++hidden;
      said += o.estimate.state == TargetState::kOccluded;
      EXPECT_TRUE(Inside(o, 16.3)) << o.t << " error " << Error(o);  // 99.9 %
    }
    if (hidden > 0 && o.visible_share >= 0.5 && back_since < 0.0) back_since = o.t;
    if (back_since > 0.0 && found < 0.0 && Detected(o)) found = o.t;
  }
  EXPECT_GT(hidden, 70);
  EXPECT_GE(said, hidden - 2);
  ASSERT_GT(back_since, 0.0);
  ASSERT_GT(found, 0.0);
  EXPECT_LE(found, back_since + 0.3);
}

/// Half as large as the target, it looks like one twice as far away, which would drive. What drives
/// and is as large, as LiDAR tells, is tracked from the same rails.
TEST(PerceptionAlike, WhatIsSmallAndStandsDoesNotDriveAsTheDroneDoes) {
  World w;
  w.body = [](double t) { return Body{{0.0, 0.9 * t - 0.6, 1.0}}; };
  FlyOptions options;
  options.duration = 1.4;
  w.target = [](double t) { return Vector3d(4.0, 0.5 * t, 0.6); };
  EXPECT_TRUE(Detected(Fly(w, {}, options).back()));
  options.lidar = false;
  w.target = [](double) { return Vector3d(-8.0, 0.0, 0.55); };  // behind the drone
  w.things.push_back({Thing::Kind::kCylinder, {4.0, 0.0, 0.6}, {0.075, 0.075, 0.125}, kOrange});
  for (const auto& o : Fly(w, {}, options)) EXPECT_NE(o.estimate.state, TargetState::kTracking);
}

}  // namespace
}  // namespace chase::perception
