#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "services/planning/certificate.h"
#include "services/planning/cost.h"
#include "services/planning/planner.h"
#include "services/planning/problem.h"
#include "services/planning/stopping.h"

namespace chase::planning {
namespace {

PlannerConfig Config() {
  PlannerConfig c;
  c.skeletons = 6;
  c.steps = 3;
  return c;
}

/// A target walking east at 1 m/s, the drone 2.5 m behind it.
PlanRequest Walk() {
  PlanRequest r;
  r.horizon = 2.5;
  r.start.p = {-2.5, 0.0, 1.4};
  r.start.v = {1.0, 0.0, 0.0};
  r.target = {0.0, 2.5, Eigen::MatrixXd::Zero(2, 3)};
  r.target.coefficients << 0.0, 0.0, 0.8, 2.5, 0.0, 0.0;
  return r;
}

world::Obstacle Pillar(int id, double x, double y, double radius) {
  world::Obstacle o;
  o.id = id;
  o.center = world::Trajectory::Constant({x, y, 1.0}, 0.0, 2.5);
  const double r = 1.0 / (radius * radius);
  o.shape = Eigen::Vector3d(r, r, 0.1).asDiagonal();
  return o;
}

void ExpectContinues(const PlanResult& plan, const PlanRequest& request) {
  const world::State s = plan.trajectory.At(request.t0);
  EXPECT_LT((s.p - request.start.p).norm(), 1e-9);
  EXPECT_LT((s.v - request.start.v).norm(), 1e-9);
  EXPECT_LT((s.a - request.start.a).norm(), 1e-9);
  EXPECT_TRUE(plan.verdict >= Verdict::kBrake || (s.j - request.start.j).norm() < 1e-9);
  EXPECT_TRUE(plan.trajectory.coefficients.allFinite());
  for (double y : plan.yaw) EXPECT_TRUE(std::isfinite(y));
}

TEST(Ladder, OpenFieldIsAChaseInSight) {
  const auto planner = MakePlanner("chase", Config());
  PlanRequest request = Walk();
  request.obstacles = {Pillar(1, 1.0, 1.2, 0.3), Pillar(2, 1.0, -1.4, 0.3)};
  const PlanResult plan = planner->Plan(request);
  EXPECT_EQ(plan.verdict, Verdict::kChase) << plan.reason;
  EXPECT_EQ(plan.reason, "");
  ExpectContinues(plan, request);
  EXPECT_TRUE(planner->IsCertified(request, plan.trajectory));
  EXPECT_GT(plan.feasible, 0);
  const Problem problem = MakeProblem(Config(), request, nullptr);
  EXPECT_EQ(SampleFaults(plan.trajectory.coefficients, problem, 0.0, 500), "");
}

// With no running plan to improve on either.
TEST(Ladder, WhatIsTakenIsRefined) {
  PlannerConfig plain = Config();
  plain.refine = false;
  const auto refining = MakePlanner("chase", Config()), choosing = MakePlanner("chase", plain);
  for (const double aside : {-1.2, -0.4, 0.3, 0.9}) {
    PlanRequest request = Walk();
    request.obstacles = {Pillar(1, 0.8, aside, 0.3)};
    const PlanResult refined = refining->Plan(request), chosen = choosing->Plan(request);
    EXPECT_EQ(refined.verdict, chosen.verdict) << aside;
    EXPECT_LT(refined.cost.total, chosen.cost.total) << aside;
    EXPECT_EQ(refined.winner, -1) << aside << ": no candidate any more";
  }
}

TEST(Ladder, SameRequestSameBits) {
  const auto a = MakePlanner("chase", Config()), b = MakePlanner("chase", Config());
  PlanRequest request = Walk();
  request.obstacles = {Pillar(1, 1.0, 1.0, 0.3)};
  b->Plan(Walk());
  const PlanResult x = a->Plan(request), y = b->Plan(request);
  EXPECT_EQ(x.trajectory.coefficients, y.trajectory.coefficients);
  EXPECT_EQ(x.yaw, y.yaw);
  EXPECT_EQ(x.checked, y.checked);
}

TEST(Ladder, StartInsideTheMarginStillPlans) {
  PlanRequest request = Walk();
  const double off = Config().hard_radius() + 0.5 * Config().safety_margin;
  request.obstacles = {Pillar(1, -2.5, 0.3 + off, 0.3)};
  const PlanResult plan = MakePlanner("chase", Config())->Plan(request);
  EXPECT_EQ(plan.verdict, Verdict::kChase) << plan.reason;
  EXPECT_NE(plan.reason.find("margin of obstacle 1"), std::string::npos) << plan.reason;
}

// On its edge no plan could be proved to keep it: the start counts as within.
TEST(Ladder, StartOnTheEdgeOfTheMarginStillPlans) {
  const double off = Config().hard_radius() + Config().safety_margin;
  for (const double beyond : {-1e-5, -1e-9, 0.0, 1e-9, 1e-5}) {
    PlanRequest request = Walk();
    request.obstacles = {Pillar(1, -2.5, 0.3 + off + beyond, 0.3)};
    request.obstacles[0].center = world::Trajectory::Constant(
        request.start.p + Eigen::Vector3d(0.0, 0.3 + off + beyond, 0.0), 0.0, 2.5);
    const PlanResult plan = MakePlanner("chase", Config())->Plan(request);
    EXPECT_EQ(plan.verdict, Verdict::kChase) << beyond << plan.reason;
  }
}

TEST(Ladder, StartInsideTheHardRadiusIsAnEscapeThatOnlyMovesAway) {
  PlanRequest request = Walk();
  request.obstacles = {Pillar(1, -2.5, 0.55, 0.3)};  // 0.25 m from the drone's centre
  const PlanResult plan = MakePlanner("chase", Config())->Plan(request);
  EXPECT_EQ(plan.verdict, Verdict::kEscape) << plan.reason;
  EXPECT_NE(plan.reason.find("inside obstacle 1"), std::string::npos) << plan.reason;
  double before = 0.55;
  for (double t = 0.02; t <= plan.trajectory.duration; t += 0.02) {
    const double away =
        (plan.trajectory.Position(t) - request.obstacles[0].center.Position(t)).head<2>().norm();
    if (t < 0.25 * plan.trajectory.duration)
      EXPECT_GE(away, before - 1e-9) << t;
    else
      EXPECT_GE(away, 0.3 + Config().hard_radius() - 1e-9) << t;
    before = away;
  }
}

TEST(Ladder, TargetAlreadyHiddenGivesASafePlanThatRegainsSight) {
  PlanRequest request = Walk();
  request.obstacles = {Pillar(1, -1.0, 0.0, 0.3)};  // right between the two
  const PlanResult plan = MakePlanner("chase", Config())->Plan(request);
  EXPECT_EQ(plan.verdict, Verdict::kSafeOnly) << plan.reason;
  EXPECT_TRUE(std::any_of(plan.proofs.begin(), plan.proofs.end(), [](const Proof& proof) {
    return proof.of_sight && proof.from > 0.0 && proof.from < 1.0;
  })) << plan.reason;
  ExpectContinues(plan, request);
  Problem problem = MakeProblem(Config(), request, nullptr);
  problem.limits.view.reset();  // not promised either
  EXPECT_EQ(SampleFaults(plan.trajectory.coefficients, problem, 1.0, 500), "");
}

TEST(Ladder, TargetInsideAnObstacleIsSaidAndDoesNotBlockEverything) {
  PlanRequest request = Walk();
  request.obstacles = {Pillar(7, 1.0, 0.0, 0.3)};  // the target walks through it
  const PlanResult plan = MakePlanner("chase", Config())->Plan(request);
  EXPECT_EQ(plan.verdict, Verdict::kSafeOnly);
  EXPECT_NE(plan.reason.find("obstacle 7 holds the target"), std::string::npos) << plan.reason;
}

TEST(Ladder, NothingFeasibleBrakesToRest) {
  PlanRequest request = Walk();
  for (int i = 0; i < 16; ++i) {  // a cage around the drone
    const double angle = 2.0 * M_PI * i / 16;
    request.obstacles.push_back(
        Pillar(i, -2.5 + 1.3 * std::cos(angle), 1.3 * std::sin(angle), 0.4));
  }
  const PlanResult plan = MakePlanner("chase", Config())->Plan(request);
  EXPECT_EQ(plan.verdict, Verdict::kBrake) << plan.reason;
  ExpectContinues(plan, request);
  const world::State end = plan.trajectory.At(plan.trajectory.end());
  EXPECT_LT(end.v.norm() + end.a.norm(), 1e-9);
}

// The ellipsoid about a thin wall holds places that are off the wall itself.
TEST(Ladder, StartOffAWallButWithinItsEllipsoidStillChases) {
  const PlannerConfig config;
  PlanRequest request = Walk();
  request.start.v.setZero();
  request.target.coefficients.row(1).setZero();
  world::Obstacle wall;
  wall.id = 3;
  wall.solid = world::Obstacle::Solid::kBox;
  wall.half = {1.5, 0.1, 1.5};
  wall.shape = (3.0 * wall.half.array().square()).inverse().matrix().asDiagonal();
  const double off = config.hard_radius() + config.safety_margin + 0.02;
  wall.center = world::Trajectory::Constant({-2.5, wall.half.y() + off, 1.4}, 0.0, 2.5);
  request.obstacles = {wall};
  const PlanResult plan = MakePlanner("chase", config)->Plan(request);
  EXPECT_EQ(plan.verdict, Verdict::kChase) << plan.reason;
  EXPECT_GE(plan.certified_clearance, 0.0);
}

// That about a cylinder reaches over it: above its middle by more than the drone needs.
TEST(Ladder, StartOverACylinderButWithinItsEllipsoidStillMoves) {
  const PlannerConfig config;
  PlanRequest request = Walk();
  request.start.v.setZero();
  world::Obstacle post;
  post.id = 3;
  post.solid = world::Obstacle::Solid::kCylinder;
  post.half = {0.3, 0.3, 1.2};
  post.shape = post.half.cwiseAbs2()
                   .cwiseProduct(Eigen::Vector3d(1.5, 1.5, 3.0))
                   .cwiseInverse()
                   .asDiagonal();
  const double off = config.hard_radius() + config.safety_margin + 0.02;
  post.center = world::Trajectory::Constant({-2.5, 0.0, 1.4 - post.half.z() - off}, 0.0, 2.5);
  request.obstacles = {post};
  const PlanResult plan = MakePlanner("chase", config)->Plan(request);
  EXPECT_LE(plan.verdict, Verdict::kSafeOnly) << plan.reason;
  EXPECT_GE(plan.certified_clearance, 0.0);
}

TEST(Ladder, KeepsTheRunningPlanWhileItIsCertified) {
  PlannerConfig config = Config();
  PlanRequest request = Walk();
  request.obstacles = {Pillar(1, 0.0, 1.4, 0.3), Pillar(2, 0.0, -1.4, 0.3)};
  const PlanResult first = MakePlanner("chase", config)->Plan(request);
  ASSERT_EQ(first.verdict, Verdict::kChase);
  config.desired_distance = 40.0;  // its candidates now all break the speed limit
  config.refine = false;           // nor is the running plan one of them
  request.t0 = 0.2;
  request.start = first.trajectory.At(0.2);
  request.running = first.trajectory;
  const PlanResult kept = MakePlanner("chase", config)->Plan(request);
  EXPECT_EQ(kept.verdict, Verdict::kKept) << kept.reason;
  EXPECT_LT((kept.trajectory.Position(1.5) - first.trajectory.Position(1.5)).norm(), 1e-9);
}

// A drone on a slalom between pillars, planned anew every 0.3 s: whenever the running plan carried
// on is feasible, the new plan costs no more.
TEST(Ladder, NeverCostsMoreThanTheRunningPlanCarriedOn) {
  const PlannerConfig config = Config();
  const auto planner = MakePlanner("chase", config);
  PlanRequest request = Walk();
  for (int i = 0; i < 6; ++i)
    request.obstacles.push_back(Pillar(i, -1.0 + 1.6 * i, i % 2 ? 1.1 : -1.1, 0.3));
  int compared = 0, kept = 0;
  for (int i = 0; i < 20; ++i) {
    const PlanResult plan = planner->Plan(request);
    if (request.running) {
      const Problem problem = MakeProblem(config, request, nullptr);
      Curve carried = ToCurve(*request.running, request.t0, request.horizon);
      carried.topRows(4) = problem.start;
      if (IsFeasible(carried, problem, 0.0, true, Arithmetic::kCertified)) {
        ++compared;
        kept += plan.winner < 0;
        EXPECT_EQ(plan.verdict, Verdict::kChase) << plan.reason;
        EXPECT_LE(plan.cost.total, Evaluate(config, problem, carried).total * (1.0 + 1e-9));
      }
    }
    ExpectContinues(plan, request);
    request.t0 += 0.3;
    request.start = plan.trajectory.At(request.t0);
    request.running = plan.trajectory;
  }
  EXPECT_GT(compared, 10);
  EXPECT_GT(kept, 0);
}

// A low target that runs ahead draws the drone down, plan after plan, to the least height but not
// below.
TEST(Ladder, AChainOfPlansKeepsTheHeight) {
  PlannerConfig config = Config();
  config.elevation_low_deg = -4.0;
  config.elevation_high_deg = 4.0;
  config.z_min = 0.6;
  const auto planner = MakePlanner("chase", config);
  PlanRequest request = Walk();
  request.start.p.z() = 0.8;
  double lowest = 1.0;
  for (int i = 0; i < 60; ++i) {
    request.target = {request.t0, 2.5, Eigen::MatrixXd::Zero(2, 3)};
    request.target.coefficients << 1.6 * request.t0, 0.0, 0.3, 4.0, 0.0, 0.0;
    const PlanResult plan = planner->Plan(request);
    EXPECT_LT(plan.verdict, Verdict::kSafeOnly) << i << " " << plan.reason;
    request.t0 += 0.15;
    request.start = plan.trajectory.At(request.t0);
    request.running = plan.trajectory;
    lowest = std::min(lowest, request.start.p.z());
  }
  EXPECT_GT(lowest, config.z_min - 0.01);
  EXPECT_LT(lowest, config.z_min + 0.1);
}

// Where the start is below the least height, or cannot help sinking there, no plan sinks further.
TEST(Problem, HeightGivesWayToTheStartOnly) {
  PlannerConfig config = Config();
  PlanRequest request = Walk();
  request.start.p.z() = config.z_min + 0.01;
  EXPECT_EQ(MakeProblem(config, request, nullptr).limits.z_min, config.z_min);
  EXPECT_EQ(MakeProblem(config, request, nullptr).limits.z_max, config.z_max);
  request.tube = config.tracking_tube + 0.1;  // nothing is listed above what the file's reaches
  EXPECT_NEAR(MakeProblem(config, request, nullptr).limits.z_max, config.z_max - 0.1, 1e-9);
  request.tube = 0.0;
  request.start.p.z() = config.z_min - 0.2;
  EXPECT_NEAR(MakeProblem(config, request, nullptr).limits.z_min, request.start.p.z(), 1e-5);
  request.start.v.z() = -0.5;
  EXPECT_LT(MakeProblem(config, request, nullptr).limits.z_min, request.start.p.z() - 0.1);
  request.start.p.z() = config.z_max + 0.2;
  EXPECT_NEAR(MakeProblem(config, request, nullptr).limits.z_max, request.start.p.z(), 1e-5);
}

TEST(Ladder, BrakingJustAboveTheLeastHeightIsSafeThoughItSinks) {
  const PlannerConfig config = Config();
  for (const double speed : {0.0, 0.1, 0.3, 0.8}) {
    PlanRequest request = Walk();
    request.start.p.z() = config.z_min + 0.01;
    request.start.v.z() = -speed;
    const std::optional<Stop> stop = Brake(config, request);
    ASSERT_TRUE(stop) << speed;
    const world::Trajectory& brake = stop->trajectory;
    EXPECT_GT(brake.Position(brake.end()).z(), request.start.p.z() - 0.37 * speed - 1e-6);
    request.start.p.z() = config.z_max - 0.01;
    request.start.v.z() = speed;
    EXPECT_TRUE(Brake(config, request)) << speed << " upwards";
  }
}

TEST(Ladder, ObstacleOnTheRunningPlanEndsItsCertificate) {
  const auto planner = MakePlanner("chase", Config());
  PlanRequest request = Walk();
  const PlanResult plan = planner->Plan(request);
  EXPECT_TRUE(planner->IsCertified(request, plan.trajectory));
  const Eigen::Vector3d ahead = plan.trajectory.Position(1.5);
  request.obstacles = {Pillar(3, ahead.x(), ahead.y(), 0.3)};
  EXPECT_FALSE(planner->IsCertified(request, plan.trajectory));
}

TEST(Ladder, AHoverIsCertifiedInFreeSpaceOnly) {
  const auto planner = MakePlanner("chase", Config());
  PlanRequest request = Walk();
  request.start.v.setZero();
  const world::Trajectory hover =
      world::Trajectory::Constant(request.start.p, request.t0, request.horizon);
  request.obstacles = {Pillar(1, 1.0, 4.0, 0.3)};
  EXPECT_TRUE(planner->IsCertified(request, hover));
  request.obstacles = {Pillar(1, request.start.p.x(), request.start.p.y(), 0.3)};
  EXPECT_FALSE(planner->IsCertified(request, hover));
}

TEST(Ladder, TargetOnTopOfTheDroneIsSurvived) {
  PlanRequest request = Walk();
  request.start.p = request.target.Position(0.0);
  const PlanResult plan = MakePlanner("chase", Config())->Plan(request);
  ExpectContinues(plan, request);
}

TEST(Ladder, NotFiniteRequestGivesNoFeasibleCandidate) {
  PlanRequest request = Walk();
  request.start.v.x() = std::nan("");
  const PlanResult plan = MakePlanner("chase", Config())->Plan(request);
  EXPECT_EQ(plan.verdict, Verdict::kBrake);
}

TEST(Planner, UnknownNameIsRefusedWithTheKnownOnes) {
  try {
    MakePlanner("fastest", PlannerConfig());
    FAIL();
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("reference-double"), std::string::npos);
  }
}

}  // namespace
}  // namespace chase::planning
