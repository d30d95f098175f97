// When something that may be the target has surely driven.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "services/perception/belief/perceiver.h"
#include "services/perception/belief/track.h"

namespace chase::perception {
namespace {

using Eigen::Vector3d;

/// Seen from the origin and surely of the target's shape, 0.3 s after it was first known.
Track CandidateAt(const Vector3d& first, const Vector3d& now, double sigma) {
  Track c;
  c.state.mean << first, Vector3d::Zero();
  c.state.covariance = sigma * sigma * Matrix6d::Identity();
  c.odds = c.last.fit.log_odds = 20.0;
  c.last.detection.silhouette.sigma_px = 0.5;
  c.last.detection.box.height = 0.5 * 220.0 / first.norm();
  c.last.detection.box.width = 0.6 * c.last.detection.box.height;
  c.first = c.Now();
  c.state.mean.head<3>() = now;
  c.t = 0.3;
  return c;
}

TEST(PerceptionCandidate, DrivesOnceItsWayIsMoreThanItsErrorsAndItsEdges) {
  const Vector3d p(3.0, 0.0, 0.55);
  EXPECT_FALSE(CandidateAt(p, p, 0.01).Drives());
  EXPECT_FALSE(CandidateAt(p, p + Vector3d(0.0, 0.03, 0.0), 0.001).Drives());
  EXPECT_TRUE(CandidateAt(p, p + Vector3d(0.0, 0.10, 0.0), 0.01).Drives());
  EXPECT_FALSE(CandidateAt(p, p + Vector3d(0.0, 0.10, 0.0), 0.05).Drives());
  EXPECT_FALSE(CandidateAt(p, p + Vector3d(0.0, 0.0, 1.0), 0.01).Drives()) << "up is not away";
}

TEST(PerceptionCandidate, WhatIsOfAnotherShapeIsNotTakenHoweverFarItGoes) {
  const Vector3d p(3.0, 0.0, 0.55);
  Track c = CandidateAt(p, p + Vector3d(0.0, 1.0, 0.0), 0.01);
  EXPECT_TRUE(c.Drives());
  c.last.fit.log_odds = 4.0;
  EXPECT_FALSE(c.Drives());
  c.last.fit.log_odds = 20.0;
  c.odds = 6.0;
  EXPECT_FALSE(c.Drives()) << "one good sighting among bad ones";
}

TEST(PerceptionCandidate, WhatOnlyTheSizeTellsOfItsRangeIsNoWay) {
  const Vector3d p(20.0, 0.0, 0.55);  // six pixels high: one pixel is three metres of range
  Track c = CandidateAt(p, p + Vector3d(-4.0, 0.0, 0.0), 0.03);
  EXPECT_FALSE(c.Drives());
  c.first.covariance = 1e-3 * Eigen::Matrix3d::Identity();
  c.last.fit.n_points = 12;
  EXPECT_TRUE(c.Drives()) << "LiDAR tells both ends";
  c.last.fit.n_points = 4;
  EXPECT_FALSE(c.Drives()) << "so few may be of what stands behind";
}

TEST(PerceptionCandidate, OfAnotherSizeItSeemsToGoAsTheDroneDoes) {
  const Vector3d p(3.0, 0.0, 0.55), way(0.0, 0.2, 0.0);
  Track c = CandidateAt(p, p + way, 0.01);
  EXPECT_TRUE(c.Drives());
  c.p_WC = way;
  EXPECT_FALSE(c.Drives());
  c.sized = true;
  EXPECT_TRUE(c.Drives()) << "LiDAR has told its size";
  c.sized = false;
  c.state.mean[1] = -0.6;
  EXPECT_TRUE(c.Drives()) << "it would have to be larger than things are";
}

TEST(PerceptionCandidate, APieceMustGoFurtherThanItsMiddleMayShift) {
  const Vector3d p(3.0, 0.0, 0.55);
  for (const double way : {0.1, 0.3})
    for (const bool piece : {false, true}) {
      Track c = CandidateAt(p, p, 0.01);
      c.last.fit.n_points = 20;
      c.partial = piece;
      c.first = c.Now();
      c.t = 1.0;
      c.state.mean[1] = way;
      EXPECT_EQ(c.Drives(), !piece || way > 0.2) << way;
    }
}

TEST(PerceptionCandidate, APieceStaysOneUntilAllOfItIsSeen) {
  const Vector3d p(3.0, 0.0, 0.55);
  Track c = CandidateAt(p, p, 0.01);
  c.part = true;
  Sighting s = c.last;
  s.fit.posterior = c.state;
  s.detection.cut[kLeft] = true;
  c.Correct(s, Vector3d::Zero());
  EXPECT_TRUE(c.part) << "the image's border may hide what it belongs to";
  s.detection.cut[kLeft] = false;
  c.Correct(s, Vector3d::Zero());
  EXPECT_FALSE(c.part);
}

TEST(PerceptionCandidate, WhatComesOutFromBehindSomethingMustDriveFromThere) {
  const Vector3d p(3.0, 0.0, 0.55), q = p + Vector3d(0.0, 0.08, 0.0);
  Track c = CandidateAt(p, p, 0.01);
  c.partial = true;
  c.first = c.Now();
  c.t = 0.6;
  Sighting s = c.last;
  s.fit.posterior = c.state;
  s.fit.posterior.mean.head<3>() = q;
  s.fit.whole = true;
  c.Correct(s, Vector3d::Zero());
  EXPECT_FALSE(c.partial);
  EXPECT_FALSE(c.Drives()) << "the edge of what hid it may have gone, not the thing";
}

TEST(PerceptionCandidate, ADriftOfSecondsIsNoWay) {
  const Vector3d p(3.0, 0.0, 0.55);
  Track c = CandidateAt(p, p + Vector3d(0.0, 0.075, 0.0), 0.01);
  c.t = 0.5;
  EXPECT_TRUE(c.Drives());
  c.t = 3.0;
  EXPECT_FALSE(c.Drives()) << "0.03 m/s";
}

TEST(PerceptionCandidate, HowLongItStoodBeforeDoesNotCount) {
  const Vector3d p(3.0, 0.0, 0.55);
  Track c = CandidateAt(p, p, 0.01);
  Sighting s = c.last;
  s.fit.posterior = c.state;
  for (; c.t < 20.0; c.t += 0.05) c.Correct(s, Vector3d::Zero());
  ASSERT_FALSE(c.Drives());
  s.fit.posterior.mean[1] = 0.25;
  c.t += 0.3;
  c.Correct(s, Vector3d::Zero());
  EXPECT_TRUE(c.Drives());
}

TEST(PerceptionCandidate, PointsOfTheFirstSightingRangeItsTrack) {
  Sighting s;
  s.detection.box = {0, 0, 20, 40};
  EXPECT_LT(StartTrack(s, 2.5, {}).ranged, 0.0);
  s.fit.n_points = 12;
  EXPECT_EQ(StartTrack(s, 2.5, {}).ranged, 2.5);
}

TEST(PerceptionCandidate, IsSizedWhereLidarSurelyHitAllOfIt) {
  Track c = CandidateAt({3.0, 0.0, 0.55}, {3.0, 0.0, 0.55}, 0.01);
  Sighting s = c.last;
  s.fit.posterior = c.state;
  const auto correct = [&](int points, bool whole) {
    c.t += 0.05;
    s.fit.n_points = points;
    s.fit.whole = whole;
    c.Correct(s, Vector3d::Zero());
    return c.sized;
  };
  EXPECT_FALSE(correct(0, true));
  EXPECT_FALSE(correct(9, true));
  EXPECT_DOUBLE_EQ(c.ranged, c.t);
  EXPECT_FALSE(correct(12, false)) << "half of it tells no size";
  EXPECT_TRUE(correct(12, true));
  EXPECT_TRUE(correct(0, true)) << "and it stays so";
}

TEST(PerceptionEstimate, ExistsWhereItIsSaidToBeAsFarAsItsCovarianceTells) {
  TargetEstimate e;
  e.state = TargetState::kOccluded;
  EXPECT_LT((e.covariance *= 1e4, e.Existence()), 1e-4) << "nothing is known";
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (const double sigma : {0.05, 0.3, 0.5, 1.0}) {
    e.covariance = Eigen::Vector3d(sigma, 1.3 * sigma, 0.1).cwiseAbs2().asDiagonal();
    int within = 0;
    for (int i = 0; i < 20000; ++i)
      within += std::hypot(sigma * normal(random), 1.3 * sigma * normal(random)) < 0.5;
    EXPECT_NEAR(e.Existence(), within / 20000.0, 0.02) << sigma;
  }
}

}  // namespace
}  // namespace chase::perception
