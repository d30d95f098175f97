// Perception over whole sequences of a synthetic world, as a node would feed it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "perception_world.h"

namespace chase::perception {
namespace {

using Eigen::Vector3d;
using perception_test::Fly;
using perception_test::FlyOptions;
using perception_test::GymWorld;
using perception_test::kOrange;
using perception_test::Outcome;
using perception_test::StillWorld;
using perception_test::TakenAtOnce;
using perception_test::Thing;
using perception_test::World;

double Error(const Outcome& o) { return (o.estimate.p_WT - o.truth).norm(); }
bool Detected(const Outcome& o) {
  return o.estimate.state == TargetState::kTracking && o.estimate.box.width > 0.0;
}

/// The target crosses from right to left at 3.5 m and is fully hidden by a pillar for a while.
World CrossingWorld() {
  World w = StillWorld(3.5);
  w.target = [](double t) { return Vector3d(3.5, -1.3 + 0.8 * t, 0.55); };
  w.things.push_back({Thing::Kind::kCylinder, {2.0, 0.0, 1.5}, {0.28, 0.28, 1.5}, {0.5, 0.6, 0.7}});
  return w;
}

TEST(PerceptionFlight, FollowsTheTargetThroughAGymWithLookAlikes) {
  FlyOptions options;
  options.duration = 7.0;
  int visible = 0, seen = 0;
  double sum = 0.0, nees = 0.0;
  for (const auto& o : Fly(GymWorld(3), {}, options)) {
    if (o.visible_share < 0.5 || o.t < 0.3) continue;
    ++visible;
    if (!Detected(o)) continue;
    ++seen;
    sum += Error(o) * Error(o);
    const Vector3d e = o.estimate.p_WT - o.truth;
    nees += e.dot(o.estimate.covariance.ldlt().solve(e));
    EXPECT_LT(Error(o), 0.25) << o.t;
    EXPECT_LT((o.estimate.v_WT - o.velocity).norm(), 1.0) << o.t;
  }
  ASSERT_GT(visible, 80);
  EXPECT_GE(seen, 0.97 * visible);
  EXPECT_LT(std::sqrt(sum / seen), 0.06);
  EXPECT_LT(nees / seen, 5.0);
}

TEST(PerceptionFlight, FullOcclusionIsSaidAndEndedQuickly) {
  FlyOptions options;
  options.duration = 3.2;
  double hidden_since = -1.0, back_since = -1.0, said = -1.0, found = -1.0, sigma_before = 0.0;
  double sigma_hidden = 0.0;
  for (const auto& o : Fly(CrossingWorld(), {}, options)) {
    const double sigma = std::sqrt(o.estimate.covariance.trace());
    if (o.visible_share == 0.0 && hidden_since < 0.0) hidden_since = o.t;
    if (hidden_since < 0.0) sigma_before = sigma;
    if (hidden_since > 0.0 && o.visible_share >= 0.5 && back_since < 0.0) back_since = o.t;
    if (o.estimate.state == TargetState::kOccluded) {
      if (said < 0.0) said = o.t;
      sigma_hidden = std::max(sigma_hidden, sigma);
      EXPECT_LT(Error(o), 3.0 * sigma + 0.05) << o.t;
    }
    if (said > 0.0 && found < 0.0 && Detected(o)) found = o.t;
  }
  ASSERT_GT(hidden_since, 0.0);
  ASSERT_GT(back_since, 0.0);
  ASSERT_GT(said, 0.0);
  EXPECT_LE(said, hidden_since + 0.15);
  EXPECT_GT(sigma_hidden, 3.0 * sigma_before);
  ASSERT_GT(found, 0.0);
  EXPECT_LE(found, back_since + 0.2);
}

TEST(PerceptionFlight, ALookAlikeIsNotTakenWhileTheTargetIsHidden) {
  World w = CrossingWorld();  // the same cylinder stands still at the right, always in view
  w.things.push_back({Thing::Kind::kCylinder, {3.2, -1.6, 0.55}, {0.15, 0.15, 0.25}, kOrange});
  w.target = [](double t) { return Vector3d(3.5, -0.9 + 0.8 * std::min(t, 1.2), 0.55); };
  FlyOptions options;
  options.duration = 3.0;
  int hidden = 0;
  for (const auto& o : Fly(w, {}, options)) {
    if (o.t < 0.3) continue;
    EXPECT_GT((o.estimate.p_WT - Vector3d(3.2, -1.6, 0.55)).norm(), 0.5) << o.t;
    if (o.t > 0.9) {  // hidden since 0.7 s
      EXPECT_EQ(o.visible_share, 0.0);
      EXPECT_NE(o.estimate.state, TargetState::kTracking) << o.t;
    }
    hidden += o.estimate.state == TargetState::kOccluded;
  }
  EXPECT_GT(hidden, 20);
}

TEST(PerceptionFlight, ANewTargetElsewhereInTheImageIsTakenAfterALoss) {
  World w = StillWorld(3.0);
  w.target = [](double t) { return Vector3d(3.0, t < 1.0 ? 0.8 : (t < 4.0 ? 40.0 : -0.9), 0.55); };
  PerceptionConfig config = TakenAtOnce();
  config.state.lost_after = 2.0;
  FlyOptions options;
  options.duration = 4.6;
  bool lost = false;
  for (const auto& o : Fly(w, config, options)) {
    lost = lost || o.estimate.state == TargetState::kLost;
    if (o.t > 3.5 && o.t < 4.0) {
      EXPECT_EQ(o.estimate.state, TargetState::kLost);
    }
    if (o.estimate.state == TargetState::kLost) {
      EXPECT_GT(o.estimate.covariance(0, 0), 100.0);
    }
    if (o.t > 4.25) {
      EXPECT_TRUE(Detected(o) && Error(o) < 0.15) << o.t;
    }
  }
  EXPECT_TRUE(lost);
}

TEST(PerceptionFlight, SizeGivesTheRangeWithoutTheLidar) {
  FlyOptions options;
  options.duration = 1.5;
  options.lidar = false;
  for (const auto& o : Fly(StillWorld(2.5), TakenAtOnce(), options)) {
    if (o.t < 0.3) continue;
    EXPECT_TRUE(Detected(o));
    EXPECT_EQ(o.estimate.n_points, 0);
    EXPECT_LT(Error(o), 0.1) << o.t;
  }
}

TEST(PerceptionFlight, ASweep150MsLateIsPlacedRight) {
  World w = StillWorld(4.0);
  w.target = [](double t) { return Vector3d(4.0, -1.0 + 0.9 * t, 0.55); };
  FlyOptions options;
  options.duration = 1.5;
  options.lidar_delay = 0.15;
  int with_points = 0;
  for (const auto& o : Fly(w, {}, options)) {
    if (o.t < 0.5) continue;
    EXPECT_TRUE(Detected(o));
    EXPECT_LT(Error(o), 0.1) << o.t;
    with_points += o.estimate.n_points > 0;
  }
  EXPECT_GT(with_points, 4);
}

struct Fault {
  const char* name;
  std::function<void(cv::Mat*)> spoil;
};

/// From 0.6 s on every image is spoilt: said within 0.15 s, covariance growing, nothing thrown.
TEST(PerceptionFaults, SpoiltImagesAreSaid) {
  const std::vector<Fault> faults = {
      {"black", [](cv::Mat* m) { m->setTo(cv::Scalar::all(0)); }},
      {"saturated", [](cv::Mat* m) { m->setTo(cv::Scalar::all(255)); }},
      {"torn", [](cv::Mat* m) { m->rowRange(100, 240).setTo(cv::Scalar::all(0)); }},
      {"size", [](cv::Mat* m) { *m = (*m)(cv::Rect(0, 0, 188, 120)).clone(); }},
      {"16bit", [](cv::Mat* m) { m->convertTo(*m, CV_16UC3, 256); }},
      {"empty", [](cv::Mat* m) { *m = cv::Mat(); }}};
  for (const auto& fault : faults) {
    FlyOptions options;
    options.duration = 1.1;
    options.spoil_image = [&](double t, cv::Mat* m) {
      if (t >= 0.6) fault.spoil(m);
    };
    double trace = 0.0;
    for (const auto& o : Fly(StillWorld(2.5), TakenAtOnce(), options)) {
      EXPECT_TRUE(o.estimate.p_WT.allFinite() && o.estimate.covariance.allFinite());
      if (o.t > 0.4 && o.t < 0.6) {
        EXPECT_TRUE(Detected(o)) << fault.name;
      }
      if (o.t < 0.6 - 1e-9) continue;
      EXPECT_NE(o.estimate.note, "") << fault.name;
      if (o.t > 0.74) {
        EXPECT_EQ(o.estimate.state, TargetState::kOccluded) << fault.name << o.t;
      }
      EXPECT_GT(o.estimate.covariance.trace(), trace) << fault.name;
      trace = o.estimate.covariance.trace();
    }
  }
}

/// Blind for 1.5 s, in which the target stops.
TEST(PerceptionFaults, ATargetNotSeenForWantOfImagesMayBeAnywhereItCouldGo) {
  World w = StillWorld(3.0);
  w.target = [](double t) { return Vector3d(3.0, 0.8 * std::min(t, 0.9), 0.55); };
  FlyOptions options;
  options.duration = 2.3;
  options.spoil_image = [](double t, cv::Mat* m) {
    if (t > 0.79) m->setTo(cv::Scalar::all(0));
  };
  for (const auto& o : Fly(w, {}, options)) {
    if (o.t < 1.3) continue;
    const Vector3d e = o.estimate.p_WT - o.truth;
    EXPECT_LT(e.dot(o.estimate.covariance.ldlt().solve(e)), 16.0) << o.t;
  }
}

TEST(PerceptionFaults, AFrameThatIsNotNewerIsSaidAndChangesNothing) {
  const World w = StillWorld(2.5);
  perception_test::Renderer renderer(w);
  Perceiver perceiver(TakenAtOnce());
  TargetEstimate last;
  cv::Mat bgr;
  for (int k = 1; k <= 10; ++k) {
    perceiver.AddPose(renderer.Pose(0.05 * k));
    bgr = renderer.Image(0.05 * k).bgr;
    last = perceiver.See({0.05 * k, bgr, {}});
  }
  ASSERT_EQ(last.state, TargetState::kTracking);
  for (const double t : {0.5, 0.42}) {
    const auto again = perceiver.See({t, bgr, {}});
    EXPECT_NE(again.note.find("not newer"), std::string::npos) << again.note;
    EXPECT_EQ(again.p_WT, last.p_WT);
    EXPECT_LT((again.covariance - last.covariance).norm(), 1e-4) << "but for another pose";
  }
  perceiver.AddPose(renderer.Pose(0.55));
  EXPECT_EQ(perceiver.See({0.55, renderer.Image(0.55).bgr, {}}).note, "");
  for (double t = 0.6; t < 0.95; t += 0.05) {
    perceiver.AddPose(renderer.Pose(t));
    last = perceiver.See({t, cv::Mat::zeros(bgr.size(), CV_8UC3), {}});
  }
  ASSERT_EQ(last.state, TargetState::kOccluded);
  EXPECT_EQ(perceiver.See({0.57, bgr, {}}).state, TargetState::kOccluded);
}

TEST(PerceptionFaults, ImagesTornSidewaysDoNotMoveTheTarget) {
  FlyOptions options;
  options.duration = 1.2;
  options.spoil_image = [](double t, cv::Mat* m) {  // the lower part comes from elsewhere
    if (t < 0.6) return;
    cv::Mat lower = m->rowRange(140, 240), copy = lower.clone();
    copy.colRange(0, 336).copyTo(lower.colRange(40, 376));
  };
  for (const auto& o : Fly(StillWorld(2.5), TakenAtOnce(), options)) {
    if (o.t < 0.3) continue;
    const Vector3d e = o.estimate.p_WT - o.truth;
    EXPECT_LT(e.norm(), 0.15 + 3.0 * std::sqrt(o.estimate.covariance.trace())) << o.t;
  }
}

TEST(PerceptionFaults, NoPoseIsSaid) {
  FlyOptions options;
  options.duration = 1.1;
  options.pose_arrives = [](double t) { return t < 0.6; };
  for (const auto& o : Fly(StillWorld(2.5), TakenAtOnce(), options)) {
    if (o.t > 0.4 && o.t < 0.6) {
      EXPECT_TRUE(Detected(o));
    }
    if (o.t > 0.7) {
      EXPECT_EQ(o.estimate.note, o.t > 0.79 ? "no pose" : "the pose is too old") << o.t;
    }
    if (o.t > 0.78) {
      EXPECT_EQ(o.estimate.state, TargetState::kOccluded) << o.t;
    }
  }
  options.pose_arrives = [](double) { return false; };
  options.duration = 0.3;
  for (const auto& o : Fly(StillWorld(2.5), TakenAtOnce(), options)) {
    EXPECT_EQ(o.estimate.state, TargetState::kSearching);
    EXPECT_EQ(o.estimate.note, "no pose");
  }
}

TEST(PerceptionFlight, TwoRunsAreTheSameToTheBit) {
  FlyOptions options;
  options.duration = 1.0;
  const auto a = Fly(GymWorld(1), {}, options), b = Fly(GymWorld(1), {}, options);
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].estimate.p_WT, b[i].estimate.p_WT);
    EXPECT_EQ(a[i].estimate.covariance, b[i].estimate.covariance);
    EXPECT_EQ(a[i].estimate.n_points, b[i].estimate.n_points);
  }
}

}  // namespace
}  // namespace chase::perception
