#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "services/control/plan_follower.h"

namespace chase::control {
namespace {

using Eigen::Vector3d;

/// Moves along x at `speed` from x0 and curves along y.
Plan Moving(double start, double duration, double x0, double speed) {
  Plan plan;
  plan.position = {start, duration, Eigen::MatrixXd::Zero(4, 3)};
  plan.position.coefficients(0, 0) = x0;
  plan.position.coefficients(1, 0) = speed * duration;
  plan.position.coefficients(2, 1) = 0.5 * duration * duration;
  plan.position.coefficients(3, 2) = 0.1 * duration * duration * duration;
  plan.yaw = Eigen::Vector2d(0.3, 0.5 * duration);
  return plan;
}

TEST(PlanFollower, HasNothingBeforeTheFirstPlanStarts) {
  PlanFollower follower(0.6);
  EXPECT_FALSE(follower.At(0.0));
  follower.Add(Moving(1.0, 2.0, 0.0, 1.0));
  EXPECT_FALSE(follower.At(0.99));
  EXPECT_TRUE(follower.At(1.0));
}

TEST(PlanFollower, GivesPlanAsItIsBeforeItsLastPart) {
  const Plan plan = Moving(1.0, 2.0, 0.0, 1.0);
  for (double t = 1.0; t < 2.39; t += 0.1) {
    const Reference r = Sample(plan, t, 0.6);
    EXPECT_EQ(r.state.p, plan.position.Position(t));
    EXPECT_EQ(r.state.j, plan.position.Derivative(3, t));
    EXPECT_NEAR(r.yaw, 0.3 + 0.5 * (t - 1.0), 1e-12);
    EXPECT_NEAR(r.yaw_rate, 0.5, 1e-12);
  }
}

TEST(PlanFollower, SwitchesAtTheNewPlansStart) {
  PlanFollower follower(0.6);
  follower.Add(Moving(0.0, 2.0, 0.0, 1.0));
  follower.Advance(0.5);
  EXPECT_TRUE(follower.Add(Moving(1.0, 2.0, 100.0, 1.0)));
  EXPECT_LT(follower.At(0.999)->state.p.x(), 10.0);
  EXPECT_GT(follower.At(1.0)->state.p.x(), 90.0);
  follower.Advance(1.0);
  EXPECT_GT(follower.At(1.0)->state.p.x(), 90.0);
}

TEST(PlanFollower, ReferenceIsContinuousOverConsistentPlans) {
  const Plan whole = Moving(0.0, 4.0, 0.0, 2.0);
  PlanFollower follower(0.6);
  follower.Add(whole);
  for (int i = 0; i < 300; ++i) {
    const double t = 0.01 * i;
    follower.Advance(t);
    if (i % 4 == 0) {  // the same motion, over a later interval
      Plan next;
      next.position = whole.position.Reparametrised(t + 0.03, 2.5);
      next.yaw = Eigen::Vector2d(0.3 + 0.5 * (t + 0.03), 0.5 * 2.5);
      follower.Add(next);
    }
    const auto r = follower.At(t);
    EXPECT_LT((r->state.p - whole.position.Position(t)).norm(), 1e-9) << t;
    EXPECT_LT((r->state.a - whole.position.Acceleration(t)).norm(), 1e-9) << t;
    EXPECT_NEAR(r->yaw, 0.3 + 0.5 * t, 1e-9) << t;
  }
}

TEST(PlanFollower, NewPlanReplacesThoseWaitingThatStartNoEarlier) {
  PlanFollower follower(0.6);
  follower.Add(Moving(0.0, 9.0, 0.0, 1.0));
  follower.Advance(0.0);
  follower.Add(Moving(2.0, 9.0, 200.0, 1.0));
  follower.Add(Moving(1.0, 9.0, 100.0, 1.0));
  EXPECT_NEAR(follower.At(2.0)->state.p.x(), 101.0, 1e-9);
}

TEST(PlanFollower, RefusesLateAndUnusablePlans) {
  PlanFollower follower(0.6);
  follower.Add(Moving(1.0, 2.0, 0.0, 1.0));
  follower.Advance(1.0);
  EXPECT_FALSE(follower.Add(Moving(0.9, 2.0, 0.0, 1.0)));
  EXPECT_FALSE(follower.Add(Moving(1.5, 0.0, 0.0, 1.0)));
  EXPECT_FALSE(follower.Add(Moving(1.5, -1.0, 0.0, 1.0)));
  Plan plan = Moving(1.5, 2.0, 0.0, 1.0);
  plan.yaw.resize(0);
  EXPECT_FALSE(follower.Add(plan));
  plan = Moving(1.5, 2.0, std::numeric_limits<double>::quiet_NaN(), 1.0);
  EXPECT_FALSE(follower.Add(plan));
}

TEST(PlanFollower, KeepsFewWaitingPlans) {
  PlanFollower follower(0.6);
  for (int i = 0; i < 100000; ++i) follower.Add(Moving(i, 2.0, 0.0, 1.0));
  follower.Advance(5.0);
  EXPECT_TRUE(follower.At(5.0));
}

TEST(PlanFollower, StopsOnThePathAtItsEnd) {
  const Plan plan = Moving(0.0, 2.0, 0.0, 3.0);
  const Vector3d end = plan.position.Position(2.0);
  for (const double t : {2.6, 3.0, 1000.0}) {
    const Reference r = Sample(plan, t, 0.6);
    EXPECT_LT((r.state.p - end).norm(), 1e-12) << t;
    EXPECT_EQ(r.state.v.norm() + r.state.a.norm() + r.state.j.norm() + r.yaw_rate, 0.0) << t;
  }
  for (double t = 1.4; t < 2.7; t += 0.01) {  // never off the path, never beyond its end
    const Vector3d p = Sample(plan, t, 0.6).state.p;
    const double s = p.x() / 3.0;
    EXPECT_LE(s, 2.0 + 1e-12);
    EXPECT_LT((p - plan.position.Position(s)).norm(), 1e-9);
  }
}

TEST(PlanFollower, SlowingDownIsSmoothAndItsDerivativesMatch) {
  const Plan plan = Moving(0.0, 2.0, 0.0, 3.0);
  const double h = 1e-5;
  for (double t = 1.3037; t < 2.8; t += 0.0501) {
    const auto at = [&](double u) { return Sample(plan, u, 0.6); };
    const Vector3d v = (at(t + h).state.p - at(t - h).state.p) / (2 * h);
    const Vector3d a = (at(t + h).state.v - at(t - h).state.v) / (2 * h);
    const Vector3d j = (at(t + h).state.a - at(t - h).state.a) / (2 * h);
    EXPECT_LT((at(t).state.v - v).norm(), 1e-6) << t;
    EXPECT_LT((at(t).state.a - a).norm(), 1e-6) << t;
    EXPECT_LT((at(t).state.j - j).norm(), 1e-5) << t;
    EXPECT_NEAR(at(t).yaw_rate, (at(t + h).yaw - at(t - h).yaw) / (2 * h), 1e-6) << t;
  }
}

TEST(PlanFollower, PlanEndingAtRestIsFlownAsItIs) {
  Plan plan = Moving(0.0, 2.0, 0.0, 0.0);
  plan.position.coefficients.setZero();
  plan.position.coefficients.col(0) = Eigen::Vector4d(0, 3, -3, 1);  // 1 - (1 - tau)^3
  EXPECT_EQ(Sample(plan, 1.9, 0.6).state.p, plan.position.Position(1.9));
  EXPECT_EQ(Sample(plan, 2.5, 0.6).state.p, plan.position.Position(2.0));
}

TEST(PlanFollower, TellsHowLongAgoTheLastPlanEnded) {
  PlanFollower follower(0.6);
  follower.Add(Moving(0.0, 2.0, 0.0, 1.0));
  follower.Advance(0.0);
  EXPECT_NEAR(follower.Overdue(0.5), -1.5, 1e-12);
  EXPECT_NEAR(follower.Overdue(2.5), 0.5, 1e-12);
}

}  // namespace
}  // namespace chase::control
