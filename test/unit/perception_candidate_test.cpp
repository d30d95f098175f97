// When something that may be the target has surely driven.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "services/perception/belief/candidate.h"
#include "services/perception/belief/perceiver.h"

namespace chase::perception {
namespace {

using Eigen::Vector3d;

/// Seen from the origin and surely of the target's shape, 0.3 s after it was first known.
Candidate CandidateAt(const Vector3d& first, const Vector3d& now, double sigma) {
  Candidate c;
  c.track.state.mean << first, Vector3d::Zero();
  c.track.state.covariance = sigma * sigma * Matrix6d::Identity();
  c.edge = 0.5 * first.norm() / 220.0;
  c.odds = c.last.fit.log_odds = 20.0;
  c.last.detection.silhouette.sigma_px = 0.5;
  c.last.detection.box.height = 0.5 * 220.0 / first.norm();
  c.last.detection.box.width = 0.6 * c.last.detection.box.height;
  c.first = c.Now();
  c.track.state.mean.head<3>() = now;
  c.track.t = 0.3;
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
  Candidate c = CandidateAt(p, p + Vector3d(0.0, 1.0, 0.0), 0.01);
  EXPECT_TRUE(c.Drives());
  c.last.fit.log_odds = 4.0;
  EXPECT_FALSE(c.Drives());
  c.last.fit.log_odds = 20.0;
  c.odds = 6.0;
  EXPECT_FALSE(c.Drives()) << "one good sighting among bad ones";
}

TEST(PerceptionCandidate, WhatOnlyTheSizeTellsOfItsRangeIsNoWay) {
  const Vector3d p(20.0, 0.0, 0.55);  // six pixels high: one pixel is three metres of range
  Candidate c = CandidateAt(p, p + Vector3d(-4.0, 0.0, 0.0), 0.03);
  EXPECT_FALSE(c.Drives());
  c.first.covariance = 1e-3 * Eigen::Matrix3d::Identity();
  c.last.fit.n_points = 12;
  EXPECT_TRUE(c.Drives()) << "LiDAR tells both ends";
  c.last.fit.n_points = 4;
  EXPECT_FALSE(c.Drives()) << "so few may be of what stands behind";
}

TEST(PerceptionCandidate, OfAnotherSizeItSeemsToGoAsTheDroneDoes) {
  const Vector3d p(3.0, 0.0, 0.55), way(0.0, 0.2, 0.0);
  Candidate c = CandidateAt(p, p + way, 0.01);
  EXPECT_TRUE(c.Drives());
  c.p_WC = way;
  EXPECT_FALSE(c.Drives());
  c.sweeps = 1;
  EXPECT_TRUE(c.Drives()) << "LiDAR has told its size";
  c.sweeps = 0;
  c.track.state.mean[1] = -0.6;
  EXPECT_TRUE(c.Drives()) << "it would have to be larger than things are";
}

TEST(PerceptionCandidate, PiecesOfOneThingDoNotGoTheWayThatTheyTell) {
  const Vector3d p(3.0, 0.0, 0.55);
  Candidate c = CandidateAt(p, p + Vector3d(0.0, 0.24, 0.0), 0.01);
  c.track.state.mean[4] = 0.8;
  EXPECT_TRUE(c.Steady());
  c.track.state.mean[4] = 2.5;
  EXPECT_FALSE(c.Steady());
  c.track.state.mean[4] = -0.4;
  EXPECT_FALSE(c.Steady());
}

TEST(PerceptionCandidate, APieceStaysOneUntilAllOfItIsSeen) {
  const Vector3d p(3.0, 0.0, 0.55);
  Candidate c = CandidateAt(p, p, 0.01);
  c.part = true;
  Sighting s = c.last;
  s.fit.posterior = c.track.state;
  s.detection.cut[kLeft] = true;
  c.Correct(s, Vector3d::Zero());
  EXPECT_TRUE(c.part) << "the image's border may hide what it belongs to";
  s.detection.cut[kLeft] = false;
  c.Correct(s, Vector3d::Zero());
  EXPECT_FALSE(c.part);
}

TEST(PerceptionCandidate, WhatComesOutFromBehindSomethingMustDriveFromThere) {
  const Vector3d p(3.0, 0.0, 0.55), q = p + Vector3d(0.0, 0.08, 0.0);
  Candidate c = CandidateAt(p, p, 0.01);
  c.track.partial = true;
  Sighting s = c.last;
  s.fit.posterior = c.track.state;
  s.fit.posterior.mean.head<3>() = q;
  s.fit.whole = true;
  c.Correct(s, Vector3d::Zero());
  EXPECT_FALSE(c.track.partial);
  EXPECT_FALSE(c.Drives()) << "the edge of what hid it may have gone, not the thing";
  EXPECT_LT((c.first.p_WT - q).norm(), 1e-9);
}

TEST(PerceptionCandidate, ADriftOfSecondsIsNoWay) {
  const Vector3d p(3.0, 0.0, 0.55);
  Candidate c = CandidateAt(p, p + Vector3d(0.0, 0.075, 0.0), 0.01);
  c.track.t = 0.5;
  EXPECT_TRUE(c.Drives());
  c.track.t = 3.0;
  EXPECT_FALSE(c.Drives()) << "0.03 m/s";
}

TEST(PerceptionCandidate, ASmallOneThatWasAPieceMustDriveFromWhereItIsAlone) {
  const Vector3d p(9.0, 0.0, 0.55);
  for (const double width : {8.0, 30.0}) {
    Candidate c = CandidateAt(p, p, 0.01);
    c.part = true;
    Sighting s = c.last;
    s.fit.posterior = c.track.state;
    s.fit.posterior.mean[1] = 0.3;
    s.detection.box = {100.0, 80.0, width, 1.6 * width};
    c.Correct(s, Vector3d::Zero());
    EXPECT_FALSE(c.part);
    EXPECT_EQ(c.Drives(), width > 20.0) << width;
  }
}

TEST(PerceptionCandidate, HowLongItStoodBeforeDoesNotCount) {
  const Vector3d p(3.0, 0.0, 0.55);
  Candidate c = CandidateAt(p, p, 0.01);
  Sighting s = c.last;
  s.fit.posterior = c.track.state;
  for (; c.track.t < 20.0; c.track.t += 0.05) c.Correct(s, Vector3d::Zero());
  ASSERT_FALSE(c.Drives());
  s.fit.posterior.mean[1] = 0.25;
  c.track.t += 0.3;
  c.Correct(s, Vector3d::Zero());
  EXPECT_TRUE(c.Drives());
}

TEST(PerceptionCandidate, PointsOfTheFirstSightingRangeItsTrack) {
  Sighting s;
  s.detection.box = {0, 0, 20, 40};
  const View view{2.5, {}, {}, {}, {}, {}};
  EXPECT_LT(NewCandidate(s, view).track.ranged, 0.0);
  s.fit.n_points = 12;
  EXPECT_EQ(NewCandidate(s, view).track.ranged, 2.5);
}

TEST(PerceptionCandidate, CountsSightingsOfAllOfItThatLidarSurelyHit) {
  Candidate c = CandidateAt({3.0, 0.0, 0.55}, {3.0, 0.0, 0.55}, 0.01);
  Sighting s = c.last;
  s.fit.posterior = c.track.state;
  for (const int points : {0, 12, 9, 15}) {
    c.track.t += 0.05;
    s.fit.n_points = points;
    c.Correct(s, Vector3d::Zero());
  }
  EXPECT_EQ(c.sweeps, 2);
  EXPECT_DOUBLE_EQ(c.track.ranged, c.track.t);
  s.fit.whole = false;
  c.Correct(s, Vector3d::Zero());
  EXPECT_EQ(c.sweeps, 2) << "half of it tells no size";
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
