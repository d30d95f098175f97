#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/math/rotation.h"
#include "services/planning/ladder.h"
#include "services/planning/planner.h"
#include "services/planning/search.h"
#include "services/planning/stopping.h"
#include "test/unit/planning_hover.h"

// What SAFETY.md promises of a single plan, judged by sampled distances.

namespace chase::planning {
namespace {

TEST(Margins, GiveWayToTheHardRadiusAndNoFurther) {
  const PlannerConfig config;
  const auto planner = MakePlanner("chase", config);
  for (const double share : {0.1, 0.4, 0.6, 0.9}) {
    PlanRequest request = Hover();
    request.start.v = {0.6, 0.0, 0.0};
    const double off = config.hard_radius() + share * config.safety_margin;
    const Vector3d at = request.start.p + Vector3d(0.0, off + 0.3, 0.0);
    request.obstacles = {Cylinder(1, at, Vector3d::Zero(), 0.3, 3.0)};
    const PlanResult plan = planner->Plan(request);
    EXPECT_LE(plan.verdict, Verdict::kKept) << plan.reason;
    EXPECT_NE(plan.reason.find("margin of obstacle 1"), std::string::npos) << plan.reason;
    for (const Proof& p : plan.proofs)
      EXPECT_TRUE(p.of_sight || (p.from == 0.0 && p.radius >= config.hard_radius())) << share;
    EXPECT_GE(LeastDistance(request.obstacles[0], plan.trajectory), config.hard_radius() - 1e-6);
  }
}

/// A target walks through a door of 1.4 m in a wall whose halves are boxes of 4 m.
TEST(Doors, OfAWallOfLongBoxesAreFollowedThrough) {
  const auto planner = MakePlanner("chase", PlannerConfig{});
  PlanRequest request;
  request.start.p = {-1.4, 0.0, 1.4};
  request.start.v = {0.9, 0.0, 0.0};
  request.target.duration = request.horizon;
  request.target.coefficients = Eigen::MatrixXd::Zero(2, 3);
  request.target.coefficients.row(1) << 0.9 * request.horizon, 0.0, 0.0;
  request.target_sigma = 0.05;
  for (const double side : {-1.0, 1.0}) {
    world::Obstacle wall;
    wall.id = static_cast<int>(request.obstacles.size());
    wall.solid = world::Obstacle::Solid::kBox;
    wall.half = {0.1, 2.0, 1.5};
    wall.shape = (3.0 * wall.half.cwiseAbs2()).cwiseInverse().asDiagonal();
    wall.center = world::Trajectory::Constant({3.0, 2.7 * side, 1.5}, 0.0, 1.0);
    request.obstacles.push_back(wall);
  }
  for (int i = 0; i < 24; ++i) {
    request.target.start = request.t0;
    request.target.coefficients.row(0) << 1.0 + 0.9 * request.t0, 0.0, 0.85;
    const PlanResult plan = planner->Plan(request);
    EXPECT_LE(plan.verdict, Verdict::kKept) << request.t0 << " " << plan.reason;
    EXPECT_GE(plan.certified_clearance, 0.0) << request.t0;
    request.t0 += 0.25;
    request.start = plan.trajectory.At(std::min(request.t0, plan.trajectory.end()));
    request.running = plan.trajectory;
  }
  EXPECT_GT(request.start.p.x(), 3.5);
}

// Its manoeuvres count until a plan's stop begins, along a way to rest to its end, and no longer:
// what they add by then, spread over the square of the time.
TEST(TargetBody, ManoeuvresCountForAsLongAsAPlanIsFlown) {
  const PlannerConfig config;
  PlanRequest request = Hover();
  request.t0 = 0.3;  // after its forecast was made
  request.target_manoeuvre = {0.4, 1.0};
  request.target_body = Cylinder(kTargetId, {3.0, 0.0, 0.85}, {0.0, 0.0, 0.0}, 0.3, 0.85);
  request.target_body->velocity_covariance = 0.01 * Eigen::Matrix3d::Identity();
  request.target_body->center.start = 0.0;
  for (const bool rests : {false, true}) {
    request.asks_sight = !rests;
    const Problem problem = MakeProblem(config, request, nullptr);
    const double T = request.horizon, age = 0.3 + (rests ? T : 0.4);
    const double rate = 0.01 + request.target_manoeuvre.Variance(age) / (age * age);
    ASSERT_TRUE(problem.target_body && problem.target_body->body);
    const auto& S = problem.target_body->body->covariance;
    EXPECT_NEAR(S[2](0, 0), T * T * rate, 1e-9) << rests;
    EXPECT_NEAR(S[0](1, 1), 0.3 * 0.3 * rate, 1e-9) << rests;
    EXPECT_NEAR(S[2](2, 2), T * T * 0.01, 1e-9) << "it stays on the ground";
  }
}

// On a slope it leads up and down as the ground does.
TEST(TargetBody, ManoeuvresLeadAlongTheGround) {
  PlanRequest request = Hover();
  request.target_manoeuvre = {0.4, 1.0};
  request.target_body = Cylinder(kTargetId, {3.0, 0.0, 0.85}, {0.0, 0.0, 0.0}, 0.3, 0.85);
  world::Obstacle slab = Wall(3, 0.0, 0.0);
  slab.ground = true;
  slab.moving = false;
  slab.half = {20.0, 20.0, 0.1};
  slab.axes = Eigen::AngleAxisd(-std::atan(0.2), Vector3d::UnitY());
  request.obstacles = {slab};
  const Problem problem = MakeProblem(PlannerConfig(), request, nullptr);
  const Eigen::Matrix3d& S = problem.target_body->body->covariance[2];
  EXPECT_GT(S(0, 0), 0.0);
  EXPECT_NEAR(S(2, 2), 0.04 * S(0, 0), 1e-9);
  EXPECT_NEAR(S(0, 2), 0.2 * S(0, 0), 1e-9);
  EXPECT_NEAR(S(1, 2), 0.0, 1e-9);
}

// Whoever stands at the end of a stop, with no planner any more, is not walked into by a target
// that turns back: it passes below.
TEST(TargetBody, AStopEndsAboveIt) {
  const PlannerConfig config;
  const auto planner = MakePlanner("chase", config);
  for (const double z : {1.0, 1.2, 1.4}) {
    PlanRequest request = Hover();
    request.start.p.z() = z;
    request.start.v.x() = 0.8;
    request.target_manoeuvre = {0.5, 0.5};
    request.target_body = Cylinder(kTargetId, {0.0, 0.0, 0.6}, {0.6, 0.0, 0.0}, 0.15, 0.25);
    request.target.coefficients << 0.0, 0.0, 0.6, 1.5, 0.0, 0.0;
    const PlanResult plan = planner->Plan(request);
    ASSERT_TRUE(plan.stop) << plan.reason;
    const Vector3d end = plan.stop->Position(plan.stop->end());
    EXPECT_GE(end.z(), 0.85 + config.hard_radius()) << z;
    world::Obstacle back = *request.target_body;
    back.center = {plan.stop->end(), 10.0, Eigen::MatrixXd::Zero(2, 3)};
    back.center.coefficients << 4.0, 0.0, 0.6, -8.0, 0.0, 0.0;
    EXPECT_GE(LeastDistance(back, world::Trajectory::Constant(end, plan.stop->end(), 10.0)),
              config.hard_radius());
  }
}

// The target may do more over a stop than until it begins: one that starts within that reach would
// leave it later only, and such a plan would say less than its verdict.
TEST(TargetBody, StopsKeepOffItFromTheirStartsOn) {
  const auto planner = MakePlanner("chase", PlannerConfig());
  int plans = 0, late = 0;
  for (double distance = 1.6; distance > 0.7; distance -= 0.06)
    for (const double speed : {0.0, 0.4, 0.8, 1.2}) {
      PlanRequest request = Hover();
      request.start.p = {-distance, 0.0, 0.9};
      request.target_manoeuvre = {0.5, 0.5};
      request.target_sigma = 0.05;
      request.target_speed_sigma = 0.2;
      request.target.coefficients << 0.0, 0.0, 0.85, -2.5 * speed, 0.0, 0.0;
      request.target_body = Cylinder(kTargetId, {0.0, 0.0, 0.85}, {-speed, 0.0, 0.0}, 0.3, 0.85);
      request.target_body->position_covariance = 0.0025 * Eigen::Matrix3d::Identity();
      request.target_body->velocity_covariance = 0.04 * Eigen::Matrix3d::Identity();
      const PlanResult plan = planner->Plan(request);
      if (plan.verdict >= Verdict::kBrake || !plan.stop) continue;
      ++plans;
      for (const Proof& proof : plan.stop_proofs) late += proof.from > 0.0;
    }
  EXPECT_GT(plans, 15);
  EXPECT_EQ(late, 0);
}

// Nothing but its body keeps the drone off the target: no least distance, and a wish to be in it.
TEST(TargetBody, IsKeptOffByPlansThatItDrivesAt) {
  PlannerConfig config;
  config.min_distance = 0.0;
  config.desired_distance = 0.5;
  const auto planner = MakePlanner("chase", config);
  int in_sight = 0;
  for (const double speed : {0.0, 0.5, 1.0, 1.5})
    for (const double across : {0.0, 0.2}) {
      PlanRequest request = Hover();
      request.target.coefficients << 0.0, across, 0.85, -2.5 * speed, 0.0, 0.0;
      const Vector3d v(-speed, 0.0, 0.0);
      request.target_body = Cylinder(kTargetId, {0.0, across, 0.85}, v, 0.3, 0.85);
      const PlanResult plan = planner->Plan(request);
      in_sight += plan.verdict <= Verdict::kKept;
      EXPECT_GE(plan.certified_clearance, 0.0) << speed << " " << plan.reason;
      EXPECT_GE(LeastDistance(*request.target_body, plan.trajectory), config.hard_radius() - 1e-6);
      EXPECT_EQ(std::count_if(plan.proofs.begin(), plan.proofs.end(),
                              [](const Proof& p) { return p.obstacle == kTargetId; }),
                1);
      ASSERT_TRUE(plan.stop || plan.verdict >= Verdict::kBrake);
      const world::Trajectory& rest = plan.stop ? *plan.stop : plan.trajectory;
      EXPECT_GE(LeastDistance(*request.target_body, rest), config.hard_radius() - 1e-6);
    }
  EXPECT_GE(in_sight, 4);
}

TEST(CertifiedPlan, IsLeftForAStopBeforeAPlannerThatFellSilentIsMissed) {
  const auto planner = MakePlanner("chase", PlannerConfig());
  PlanRequest request = Hover();
  request.obstacles = {Cylinder(1, {0.0, 3.0, 1.0}, {0.0, 0.0, 0.0}, 0.3, 2.0)};
  const PlanResult plan = planner->Plan(request);
  ASSERT_TRUE(plan.stop) << plan.reason;
  EXPECT_LE(plan.stop->start, request.t0 + 0.4 + 1e-9);
  EXPECT_TRUE(world::EndsAtRest(*plan.stop));
  EXPECT_FALSE(plan.stop_proofs.empty());
  const double t = plan.stop->start;
  EXPECT_LT((plan.stop->Position(t) - plan.trajectory.Position(t)).norm(), 1e-6);
  EXPECT_LT((plan.stop->Velocity(t) - plan.trajectory.Velocity(t)).norm(), 1e-6);
}

// A wall that may be there: the stop begins in time, where braking later would end in it. A plan
// that starts within one may only lead out: the rest of it may be solid.
TEST(CertifiedPlan, IsLeftForAStopInSpaceThatWasSeen) {
  const PlannerConfig config;
  PlanRequest request = Hover();
  world::Trajectory plan{request.t0, 2.0, Eigen::MatrixXd::Zero(2, 3)};
  plan.coefficients << 0.0, 0.0, 1.5, 3.0, 0.0, 0.0;
  request.start = plan.At(request.t0);
  const world::Obstacle wall = Wall(7, 1.45, 0.0);
  const auto blind = WayOut(config, request, plan);
  ASSERT_TRUE(blind);
  EXPECT_LT(LeastDistance(wall, blind->trajectory), config.hard_radius());
  request.unseen = {wall};
  const auto stop = WayOut(config, request, plan);
  ASSERT_TRUE(stop);
  EXPECT_GE(LeastDistance(wall, stop->trajectory), config.hard_radius() - 1e-6);
  EXPECT_TRUE(stop->proofs.empty());  // nobody else hears of it
  request.unseen = {Wall(7, 1.0, 0.0)};
  EXPECT_FALSE(WayOut(config, request, plan));
  request.unseen = {Wall(7, 0.2, 0.0)};
  EXPECT_FALSE(WayOut(config, request, plan));
  plan.coefficients.row(1) *= -1.0;
  request.start = plan.At(request.t0);
  EXPECT_TRUE(WayOut(config, request, plan));
}

TEST(CertifiedPlan, KeepsAsWideATubeOffWhatIsUnseenUntilItsStop) {
  PlanRequest request = Hover();
  world::Trajectory plan{request.t0, 2.0, Eigen::MatrixXd::Zero(2, 3)};
  plan.coefficients << 0.0, 0.0, 1.5, 3.0, 0.0, 0.0;
  request.start = plan.At(request.t0);
  request.unseen = {Cylinder(7, {0.6, 0.55, 1.5}, Vector3d::Zero(), 0.1, 3.0)};  // 0.45 m aside
  EXPECT_TRUE(WayOut(PlannerConfig(), request, plan));
  request.tube = 0.3;
  EXPECT_FALSE(WayOut(PlannerConfig(), request, plan));
}

/// Calls a plan feasible that goes straight on.
class Liar : public Search {
 public:
  Found Best(const Problem& problem, double, double, PlanProof*) override {
    Found found;
    found.index = 0;
    found.plan = problem.start;
    return found;
  }
};

// The search may be wrong: its plan is proved before it is called certified.
TEST(CertifiedPlan, DoesNotTakeTheSearchAtItsWord) {
#ifndef NDEBUG
  GTEST_SKIP() << "an assertion of the ladder's own says so first";
#endif
  PlannerConfig config;
  config.refine = false;
  PlanRequest request = Hover();
  request.start.v = {0.8, 0.0, 0.0};
  const auto plan_at = [&](double across) {
    request.obstacles = {Cylinder(1, {-1.2, across, 1.0}, {0.0, 0.0, 0.0}, 0.2, 2.0)};
    return MakeLadder(config, std::make_unique<Liar>())->Plan(request);
  };
  EXPECT_EQ(plan_at(3.0).verdict, Verdict::kChase);
  const PlanResult plan = plan_at(0.0);
  EXPECT_GE(plan.verdict, Verdict::kBrake) << plan.reason;
  EXPECT_GE(plan.certified_clearance, 0.0);
  EXPECT_GE(LeastDistance(request.obstacles[0], plan.trajectory), config.hard_radius() - 1e-6);
}

// The tube of the file, or the one that control says, where that is wider.
TEST(CertifiedPlan, KeepsSphereAndTubeOff) {
  PlanRequest request = Hover();
  request.obstacles = {Cylinder(1, {-1.0, 0.9, 1.0}, {0.0, 0.0, 0.0}, 0.1, 2.0)};
  for (const bool said : {false, true}) {
    PlannerConfig config;
    (said ? request.tube : config.tracking_tube) = 0.3;
    const PlanResult plan = MakePlanner("chase", config)->Plan(request);
    ASSERT_GE(plan.certified_clearance, 0.0) << plan.reason;
    const double least = LeastDistance(request.obstacles[0], plan.trajectory);
    EXPECT_GE(least, 0.25 + 0.3 + plan.certified_clearance - 1e-6);
    for (const Proof& p : plan.proofs) EXPECT_TRUE(p.of_sight || p.radius >= 0.25 + 0.3);
  }
}

// The ground is an obstacle that nobody lists.
TEST(CertifiedPlan, ClaimsNoMoreThanItsHeightOverTheGround) {
  const PlannerConfig config;
  PlanRequest request = Hover();
  request.start.p.z() = 0.7;
  const PlanResult plan = MakePlanner("chase", config)->Plan(request);
  double least = HUGE_VAL;
  for (int i = 0; i <= 100; ++i)
    least = std::min(least, plan.trajectory.Position(plan.trajectory.duration * i / 100.0).z());
  EXPECT_GE(plan.certified_clearance, 0.0);
  EXPECT_LE(plan.certified_clearance, std::max(0.0, least - config.hard_radius()) + 1e-9);
}

TEST(CertifiedPlan, SaysWhenTheTargetLeavesTheFieldOfView) {
  PlannerConfig config;
  config.max_yaw_rate = 0.4;
  const auto planner = MakePlanner("chase", config);
  int left = 0, kept = 0;
  for (const double off : {0.0, 0.3, 0.9, 1.5, -1.5, 3.0}) {
    PlanRequest request = Hover();
    request.yaw = YawStart{off, 0.0};
    const PlanResult plan = planner->Plan(request);
    double worst = 0.0;
    for (int i = 0; i <= 100; ++i) {
      const double tau = i / 100.0, t = tau * plan.trajectory.duration;
      const Vector3d r = request.target.Position(t) - plan.trajectory.Position(t);
      const double yaw = EvaluateYaw(plan.yaw, tau);
      worst = std::max(worst, std::abs(math::WrapAngle(std::atan2(r.y(), r.x()) - yaw)));
    }
    const bool leaves = worst > config.max_bearing_deg * M_PI / 180.0;
    EXPECT_FALSE(leaves && plan.in_field) << off;
    EXPECT_EQ(plan.in_field, plan.reason.find("field of view") == std::string::npos) << off;
    EXPECT_TRUE(plan.in_field || plan.verdict >= Verdict::kSafeOnly) << off;
    left += leaves;
    kept += plan.in_field;
  }
  EXPECT_GE(left, 2);
  EXPECT_GE(kept, 1);
}

}  // namespace
}  // namespace chase::planning
